"""How much of a road user the front camera sees, reckoned without drawing anything."""

from collections.abc import Sequence

import cv2
import numpy as np
import shapely
from jaxtyping import Float
from shapely.geometry.base import BaseGeometry

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.layout import Box, BoxKind
from dreamdrive.tasks.plan import corners, inside
from dreamdrive_bench.planning.footprints import rectangles_of

_FILLED: dict[BoxKind, float] = {"pedestrian": 0.3, "bicycle": 0.3}
_FILLED_OTHERS = 0.65  # of the outline of its hull
_NEAREST_M = 0.5
_INSIDE = np.linspace(-0.8, 0.8, 3)
_HEIGHTS = np.array([0.25, 0.55, 0.85])
_ALONG = np.linspace(0.02, 0.98, 60)


def pixels_seen(
    box: Box,
    houses: BaseGeometry,
    others: Sequence[Box],
    cameras: Sequence[Camera],
    times_s: Float[np.ndarray, " f"],
) -> Float[np.ndarray, " f"]:
    """About how many pixels of a box each picture shows (F,).

    Args:
        box: The road user.
        houses: The ground under houses, which may hide it.
        others: Road users that may hide it.
        cameras: Of the pictures, in the map frame.
        times_s: When the pictures are taken.
    """
    places, hiding = rectangles_of([box], times_s)[:, 0], rectangles_of(others, times_s)
    heights = np.array([other.size_m[2] for other in others])
    filled = _FILLED.get(box.kind, _FILLED_OTHERS)
    found = np.zeros(len(times_s))
    for k, camera in enumerate(cameras):
        eye = camera.world_from_camera[:3, 3]
        points = _samples(places[k], box.size_m[2])
        seen = _in_picture(camera, points)
        sight = eye + _ALONG[:, None] * (points[:, None] - eye)  # (points, along, 3)
        seen &= ~shapely.contains_xy(houses, sight[..., 0], sight[..., 1]).any(axis=1)
        for other, height in zip(hiding[k], heights, strict=True):
            seen &= ~(inside(sight[..., :2], other) & (sight[..., 2] < height)).any(axis=1)
        found[k] = filled * seen.mean() * _hull_px(camera, places[k], box.size_m[2])
    return found


def _samples(rectangle: Float[np.ndarray, "5"], height_m: float) -> Float[np.ndarray, "p 3"]:
    """Points spread over a box."""
    ahead, left, share = (axis.ravel() for axis in np.meshgrid(_INSIDE, _INSIDE, _HEIGHTS))
    cos, sin = np.cos(rectangle[4]), np.sin(rectangle[4])
    along, across = ahead * rectangle[2] / 2, left * rectangle[3] / 2
    return np.column_stack(
        [
            rectangle[0] + cos * along - sin * across,
            rectangle[1] + sin * along + cos * across,
            share * height_m,
        ]
    )


def _projected(camera: Camera, points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, "p 3"]:
    """Column, row and depth."""
    pose = camera.world_from_camera
    at = (points - pose[:3, 3]) @ pose[:3, :3]
    depth = np.maximum(at[:, 2], _NEAREST_M)
    return np.column_stack(
        [
            camera.fx_px * at[:, 0] / depth + camera.cx_px,
            camera.fy_px * at[:, 1] / depth + camera.cy_px,
            at[:, 2],
        ]
    )


def _in_picture(camera: Camera, points: Float[np.ndarray, "p 3"]) -> np.ndarray:
    column, row, depth = _projected(camera, points).T
    within = (column > 0) & (column < camera.width_px) & (row > 0) & (row < camera.height_px)
    return within & (depth > _NEAREST_M)


def _hull_px(camera: Camera, rectangle: Float[np.ndarray, "5"], height_m: float) -> float:
    """Area of the outline of a box, with what lies outside the picture."""
    ground = corners(rectangle)
    points = np.concatenate([np.column_stack([ground, np.full(4, z)]) for z in (0.0, height_m)])
    return float(cv2.contourArea(cv2.convexHull(_projected(camera, points)[:, :2].astype(np.float32))))
