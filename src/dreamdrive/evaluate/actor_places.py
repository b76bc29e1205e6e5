"""Errors of the places where a scene shows the road users of a world."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.evaluate.truth.drawn import Truth
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import Similarity
from dreamdrive.splat import render

LEAST_SHARE = 1e-3
"""Share of the picture that a road user has to fill at a time to be looked for."""
REACH_M = 1.0
"""How far beside a moving road user dynamic Gaussians may be and still be taken for it."""
_FOUND = 0.5


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
    scene: Scene,
    camera: Camera,
    truth: Truth,
    frame: int,
    instance: int,
    truth_from_scene: Similarity,
) -> Float[np.ndarray, "3"] | None:
    """From the true place of a moving road user to where a scene shows it, in the world of the truth.

    The place is the mean of the centres of its Gaussians, each weighing by how much of the picture it fills;
    the true place that of the true surface in the picture. So it matters little which side can be seen. On
    each axis the outer tenths are left out. The camera is that of the frame at the size of the truth.
    """
    found = gaussians_of(scene, camera, truth, frame, instance)
    if found is None:
        return None
    shown, own, fills = found
    centres = truth_from_scene(shown.means.numpy()[own].astype(np.float64))
    surface = truth.points_m(frame, truth.instance[frame] == instance)
    return _middle(centres, fills[own]) - _middle(surface, np.ones(len(surface)))


def gaussians_of(
    scene: Scene, camera: Camera, truth: Truth, frame: int, instance: int, *, moving: bool = True
) -> tuple[Gaussians, Bool[np.ndarray, " n"], Float[np.ndarray, " n"]] | None:
    """The Gaussians in a frame, those that show a road user, and how many pixels each fills.

    A moving one's are the dynamic ones that fill its pixels, or those within a metre beside it, more than
    others: one that is shown beside its true place, too, is found. What stands has no Gaussians of its own;
    its are all that fill its pixels more than others. None where it fills too little of the picture, or less
    than half of it is shown.
    """
    mask = truth.instance[frame] == instance
    if mask.mean() < LEAST_SHARE:
        return None
    around = _around(truth, frame, mask) if moving else mask
    shown = scene.at(float(scene.times_s[frame]))
    fills = contributions(shown, camera, np.stack([mask, around, np.ones_like(mask)]))
    if moving:
        fills[: len(scene.static)] = 0
    inside, near, everywhere = fills.T
    if inside.sum() < _FOUND * mask.sum():
        return None
    return shown, (everywhere > 0) & (near > _FOUND * everywhere), everywhere


@one_torch_thread()
def contributions(
    gaussians: Gaussians, camera: Camera, masks: Bool[np.ndarray, "b h w"]
) -> Float[np.ndarray, "n b"]:
    """How many pixels of each mask each Gaussian fills (N, B): its compositing weights there, summed."""
    values = torch.zeros(len(gaussians), len(masks), requires_grad=True)
    picture = render(gaussians, camera, channels=values).channels
    wanted = torch.from_numpy(masks).to(picture.dtype).permute(1, 2, 0)
    # A channel is linear in its values: their gradient is the sum of the weights.
    return torch.autograd.grad((picture * wanted).sum(), values)[0].numpy()


def _around(truth: Truth, frame: int, mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """A road user and what is within its reach beside it, but for other moving ones."""
    reach = max(1, round(REACH_M * truth.cameras[frame].fx_px / float(np.median(truth.depth_m[frame][mask]))))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    return mask | ((cv2.dilate(mask.astype(np.uint8), disc) > 0) & ~truth.moving[frame])


def _middle(points: Float[np.ndarray, "n 3"], weights: Float[np.ndarray, " n"]) -> Float[np.ndarray, "3"]:
    """Weighted mean of points, axis by axis without the outer tenths: a median jumps from side to side."""
    middle: list[float] = []
    for values in points.T:
        order = np.argsort(values)
        share = weights[order]
        below = (np.cumsum(share) - 0.5 * share) / share.sum()
        inner = (below >= 0.1) & (below <= 0.9)
        inner = inner if inner.any() else np.ones_like(inner)
        middle.append(float(np.average(values[order][inner], weights=share[inner])))
    return np.array(middle)


def actor_error(
    scene: Scene, views: Sequence[Camera], truth: Truth, truth_from_scene: Similarity
) -> ActorError:
    """Compare the way of each moving road user with the way of the dynamic Gaussians that show it.

    The views are the scene's cameras at the size of the truth.
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
            offset_m(scene, views[frame], truth, frame, instance, truth_from_scene)
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
