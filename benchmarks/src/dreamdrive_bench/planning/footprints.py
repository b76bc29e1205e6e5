"""The ground that road users cover, and whether they are clear of each other, and of houses."""

from collections.abc import Sequence

import numpy as np
import shapely
from jaxtyping import Bool, Float
from shapely.geometry.base import BaseGeometry

from dreamdrive.scene.street.layout import Box, track_function
from dreamdrive.tasks.plan import CAR, corners, overlapping

REFERENCE_BEHIND_M = 0.76
"""From the front camera back to the point of the ego that its path is given for."""
FRONT_M = CAR.ahead_m + CAR.length_m / 2 - REFERENCE_BEHIND_M
"""How far the front of the ego is ahead of its front camera."""
REAR_M = CAR.ahead_m - CAR.length_m / 2 - REFERENCE_BEHIND_M
"""How far its rear is; negative, as it lies behind."""


def rectangles_of(boxes: Sequence[Box], times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t n 5"]:
    """What boxes cover at some times (T, N, 5) in the map frame, as ``tasks.plan.rectangles`` has it."""
    found = np.zeros((len(times_s), len(boxes), 5))
    for number, box in enumerate(boxes):
        poses = track_function(box.track)(times_s)
        found[:, number, :2], found[:, number, 4] = poses[:, :2], poses[:, 2]
        found[:, number, 2:4] = box.size_m[:2]
    return found


def ego_rectangles(poses: Float[np.ndarray, "*b 3"], margin_m: float = 0.0) -> Float[np.ndarray, "*b 5"]:
    """What the ego covers with a margin (..., 5), from poses x, y, yaw (..., 3) of its reference point."""
    yaw = poses[..., 2]
    middle = poses[..., :2] + CAR.ahead_m * np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
    size = np.array([CAR.length_m, CAR.width_m]) + 2 * margin_m
    return np.concatenate([middle, np.broadcast_to(size, middle.shape), yaw[..., None]], axis=-1)


def reference_poses(camera_poses: Float[np.ndarray, "*b 3"]) -> Float[np.ndarray, "*b 3"]:
    """Poses x, y, yaw (..., 3) of the ego's reference point, from those of its front camera."""
    yaw = camera_poses[..., 2]
    back = -REFERENCE_BEHIND_M * np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=-1)
    return camera_poses + back


def meetings(
    ego: Float[np.ndarray, "t 5"], boxes: Sequence[Box], times_s: Float[np.ndarray, " t"]
) -> Bool[np.ndarray, "t n"]:
    """At which times the ego's rectangle (T, 5) touches which boxes (T, N)."""
    if not boxes:
        return np.zeros((len(times_s), 0), bool)
    return overlapping(ego[:, None], rectangles_of(boxes, times_s))


def touching(
    some: Sequence[Box], others: Sequence[Box], times_s: Float[np.ndarray, " t"], margin_m: float
) -> Bool[np.ndarray, "n m"]:
    """Which of some boxes (N,) come nearer than a margin to which others (M,) at any of the times."""
    if not some or not others:
        return np.zeros((len(some), len(others)), bool)
    wide = rectangles_of(some, times_s) + np.array([0, 0, 2 * margin_m, 2 * margin_m, 0])
    return np.any(overlapping(wide[:, :, None], rectangles_of(others, times_s)[:, None]), axis=0)


def in_the_way(
    boxes: Sequence[Box], solid: BaseGeometry, times_s: Float[np.ndarray, " t"]
) -> Bool[np.ndarray, " n"]:
    """Which boxes run into what stands on some ground, at any of the times."""
    outlines = np.array(shapely.polygons(corners(rectangles_of(boxes, times_s))))
    return np.any(np.array(shapely.intersects(solid, outlines)), axis=0)
