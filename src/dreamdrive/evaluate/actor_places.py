"""Where a scene shows the road users of a world, against where they are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.evaluate.similarity import Similarity
from dreamdrive.evaluate.truth import Truth

LEAST_SHARE = 1e-3
"""Share of the picture that a road user has to fill at a time to be looked for."""
_FOUND = 0.5


@dataclass(frozen=True)
class Sight:
    """What one frame of a scene shows.

    Attributes:
        share: Share of each pixel that the Gaussians in question fill (H, W).
        weighted_m: Sum of their centres, each times its share of the pixel, in the scene's world (H, W, 3).
    """

    share: Float[np.ndarray, "h w"]
    weighted_m: Float[np.ndarray, "h w 3"]

    def centre_m(self, mask: Bool[np.ndarray, "h w"]) -> Float[np.ndarray, "3"]:
        """Mean centre of what is shown in the pixels of a mask."""
        return self.weighted_m[mask].sum(axis=0) / self.share[mask].sum()


@dataclass(frozen=True)
class ActorError:
    """Errors in metres over all road users and times; None where none was found twice.

    Attributes:
        boxes: Moving road users that fill a thousandth of the picture at two times or more.
        found: How many of them dynamic Gaussians show, filling half of their pixels or more in at least half
            of these times.
        offset_median_m: Median distance of the place of a found one from the true place.
        displacement_median_m: Median error of the way it has gone since it was first shown.
        displacement_90_m: The same error, which 90 % stay below.
    """

    boxes: int
    found: int
    offset_median_m: float | None
    displacement_median_m: float | None
    displacement_90_m: float | None


def offset_m(
    sight: Sight, truth: Truth, frame: int, instance: int, truth_from_scene: Similarity
) -> Float[np.ndarray, "3"] | None:
    """From the true place of a road user to the place where a scene shows it, in the world of the truth.

    Both places are means over the same pixels with the same weights: of the centres of the Gaussians, and of
    the true surface. So it does not matter which side of it can be seen, or how much.

    Returns:
        The offset (3,), or None where it fills too little of the picture, or less than half of it is shown.
    """
    mask = truth.instance[frame] == instance
    if mask.mean() < LEAST_SHARE or sight.share[mask].mean() < _FOUND:
        return None
    weight = sight.share[mask][:, None]
    place = (truth.points_m(frame, mask) * weight).sum(axis=0) / weight.sum()
    return truth_from_scene.points(sight.centre_m(mask)) - place


def actor_error(sights: Sequence[Sight], truth: Truth, truth_from_scene: Similarity) -> ActorError:
    """Compare the way of each moving road user with the way of the dynamic Gaussians that show it.

    Args:
        sights: What the dynamic Gaussians show in each frame (F,).
        truth: The same frames.
        truth_from_scene: Brings the scene onto the truth.
    """
    boxes = found = 0
    offsets: list[np.ndarray] = []
    ways: list[np.ndarray] = []
    for instance in np.unique(truth.instance[truth.moving & (truth.instance > 0)]).tolist():
        large = (truth.instance == instance).mean(axis=(1, 2)) >= LEAST_SHARE
        if large.sum() < 2:
            continue
        boxes += 1
        at = [
            offset_m(sights[frame], truth, frame, instance, truth_from_scene)
            for frame in np.flatnonzero(large).tolist()
        ]
        shown = np.array([offset for offset in at if offset is not None])
        if len(shown) < max(2, 0.5 * len(at)):
            continue
        found += 1
        offsets.append(np.linalg.norm(shown, axis=1))
        ways.append(np.linalg.norm(shown[1:] - shown[0], axis=1))
    if not found:
        return ActorError(boxes, 0, None, None, None)
    way = np.concatenate(ways)
    return ActorError(
        boxes,
        found,
        float(np.median(np.concatenate(offsets))),
        float(np.median(way)),
        float(np.percentile(way, 90)),
    )
