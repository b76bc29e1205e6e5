"""The boxes of a scene's actors, against those of the road users of a world."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.optimize import linear_sum_assignment

from dreamdrive.evaluate.truth.drawn import Truth
from dreamdrive.scene.actor import Actor
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import Similarity
from dreamdrive.scene.street.truth import WorldBox
from dreamdrive.splat import render_scene

LEAST_PX = 200
"""Pixels of a frame from which on a road user or an actor counts."""
LEAST_IOU = 0.3
"""Of the masks of a road user and an actor, from which on they may be the same."""
WITHIN_M = 30.0
"""Distance from the camera up to which errors count."""


@dataclass(frozen=True)
class Miss:
    """A moving road user that is not shown as an actor in some of the frames in which it is large enough."""

    instance: int
    kind: str
    frames: int
    missed: int


@dataclass(frozen=True)
class BoxError:
    """Errors over all frames in which a moving road user and an actor fill the same pixels.

    Attributes:
        pairs: Of a road user within 30 m and an actor with a box, frame by frame.
        position_median_m: Median distance between the middles of their boxes, along the road; None without
            pairs.
        heading_median_deg: Median angle between where they point.
        heading_5_deg: Share of the pairs in which it is at most 5 degrees.
        length_median_m: Median error of the length.
        count_right: Share of the frames in which the number of actors is that of the moving road users, or
            one more or less.
        misses: Who is missed, and in how many of its frames.
    """

    pairs: int
    position_median_m: float | None
    heading_median_deg: float | None
    heading_5_deg: float | None
    length_median_m: float | None
    count_right: float
    misses: tuple[Miss, ...]


def box_error(
    scene: Scene, views: Sequence[Camera], truth: Truth, truth_from_scene: Similarity
) -> BoxError | None:
    """Compare the boxes of actors with those of road users; None where the truth holds no boxes.

    Those that fill 200 pixels or more of a frame are matched one to one by their masks, with an IoU of 0.3 or
    more. The views are the scene's cameras at the size of the truth.
    """
    if not truth.boxes:
        return None
    movers = [box for box in truth.boxes if box.moving]
    shown = np.zeros(len(movers), int)
    found = np.zeros(len(movers), int)
    right: list[bool] = []
    errors: list[tuple[float, float, float]] = []
    for frame, camera in enumerate(views):
        masks = actor_masks(scene, camera, float(scene.times_s[frame]))
        labels = np.array([box.instance for box in movers], int)[:, None, None]
        true = truth.moving[frame] & (truth.instance[frame] == labels)
        large = true.sum(axis=(1, 2)) >= LEAST_PX
        right.append(abs(int(large.sum()) - int((masks.sum(axis=(1, 2)) >= LEAST_PX).sum())) <= 1)
        shown += large
        for row, column in _matched(true, masks):
            if not large[row]:
                continue
            found[row] += 1
            pose, eye = movers[row].world_from_box[frame], truth.cameras[frame].world_from_camera[:3, 3]
            actor = scene.actors[column]
            if actor.box is not None and np.linalg.norm(pose[:3, 3] - eye) <= WITHIN_M:
                errors.append(_errors(scene, actor, frame, movers[row], pose, truth_from_scene))
    missed = [
        Miss(box.instance, box.kind, int(n), int(n - f))
        for box, n, f in zip(movers, shown, found, strict=True)
        if n > f
    ]
    count_right = float(np.mean(right))
    if not errors:
        return BoxError(0, None, None, None, None, count_right, tuple(missed))
    position_m, heading_deg, length_m = np.array(errors).T
    return BoxError(
        len(errors),
        float(np.median(position_m)),
        float(np.median(heading_deg)),
        float((heading_deg <= 5).mean()),
        float(np.median(length_m)),
        count_right,
        tuple(missed),
    )


@torch.no_grad()
def actor_masks(scene: Scene, camera: Camera, t_s: float) -> Bool[np.ndarray, "a h w"]:
    """Pixels of which each actor fills more than half."""
    size = camera.height_px, camera.width_px
    if not scene.actors or scene.dynamic.actor is None:
        return np.zeros((len(scene.actors), *size), bool)
    own = scene.dynamic.actor[scene.dynamic.alive_at(t_s)]
    ids = torch.tensor([actor.id for actor in scene.actors])
    still = torch.zeros(len(scene.static), len(ids), dtype=torch.bool)
    values = torch.cat([still, own[:, None] == ids]).float()
    return (render_scene(scene, camera, t_s, channels=values).channels > 0.5).permute(2, 0, 1).numpy()


def _matched(true: Bool[np.ndarray, "b h w"], masks: Bool[np.ndarray, "a h w"]) -> list[tuple[int, int]]:
    """Pairs of a true and a shown mask that overlap most, all of them together."""
    pixels = true.shape[1] * true.shape[2]
    one, other = (each.reshape(len(each), pixels).astype(np.float64) for each in (true, masks))
    common = one @ other.T
    iou = common / np.maximum(one.sum(axis=1)[:, None] + other.sum(axis=1) - common, 1)
    pairs = zip(*linear_sum_assignment(-iou), strict=True)
    return [(int(row), int(column)) for row, column in pairs if iou[row, column] >= LEAST_IOU]


def _errors(
    scene: Scene,
    actor: Actor,
    frame: int,
    box: WorldBox,
    pose: Float[np.ndarray, "4 4"],
    truth_from_scene: Similarity,
) -> tuple[float, float, float]:
    """Distance along the road in metres, angle in degrees, error of the length in metres."""
    assert actor.box is not None
    up = pose[:3, 2]
    at = actor.track.at(scene.times_s[frame : frame + 1])
    scene_up = truth_from_scene.rotation.T @ up
    away = truth_from_scene(at.positions_m)[0] - pose[:3, 3]
    ahead = truth_from_scene.rotation @ actor.box.pointing(float(at.yaw_rad[0]), scene_up)
    ahead -= (ahead @ up) * up
    cosine = float(ahead @ pose[:3, 0] / np.linalg.norm(ahead))
    length_m = truth_from_scene.scale * float(actor.box.size_m[0]) - float(box.size_m[0])
    angle_deg = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    return float(np.linalg.norm(away - (away @ up) * up)), angle_deg, abs(length_m)
