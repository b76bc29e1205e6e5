"""What a lidar on the car would have measured and how much of a box is seen, both from depth."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.scene.camera import NEAR_M, Camera

BEAMS = np.linspace(-30.67, 10.67, 32)
"""Elevations in degrees: those of the Velodyne HDL-32E of nuScenes."""
_STEP_DEG = 1 / 3
_BEAM_DEG = 0.35
"""How far from its beam a pixel may lie: less than half the distance of two beams."""
_REACH_M = 70.0
_STRIDE_PX = 2
_MARGIN_M = 0.3
"""How much nearer than a box something must be to stand before it."""

EGO_FROM_LIDAR = np.array([[0.0, 1, 0, 0.94], [-1, 0, 0, 0], [0, 0, 1, 1.84], [0, 0, 0, 1]])
"""Mounting of the lidar of nuScenes: x right, y ahead, z up."""

View = tuple[Camera, Float[np.ndarray, "h w"]]
"""A camera with its pose, and depth along z in metres, 0 where there is none."""


def turned(views: Sequence[View], world_from_lidar: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "n 3"]:
    """Points of one turn in the frame of the lidar: of each beam and direction the nearest pixel's.

    Cameras see from other places than the lidar: what hides something from them hides it here, too.
    """
    points = np.concatenate([np.zeros((0, 3)), *(_points(camera, depth) for camera, depth in views)])
    local = (points - world_from_lidar[:3, 3]) @ world_from_lidar[:3, :3]
    away_m = np.linalg.norm(local, axis=1)
    near = (away_m > 1.0) & (away_m < _REACH_M)
    local, away_m = local[near], away_m[near]
    up = np.rad2deg(np.arcsin(local[:, 2] / away_m))
    beam = np.abs(up[:, None] - BEAMS).argmin(axis=1)
    on = np.abs(up - BEAMS[beam]) < _BEAM_DEG
    local, away_m, beam = local[on], away_m[on], beam[on]
    bins = round(360 / _STEP_DEG)
    turn = ((np.rad2deg(np.arctan2(local[:, 1], local[:, 0])) + 180) / _STEP_DEG).astype(int) % bins
    order = np.argsort(away_m)
    _, first = np.unique((beam * bins + turn)[order], return_index=True)
    return local[np.sort(order[first])]


def share_seen(corners: Float[np.ndarray, "8 3"], views: Sequence[View]) -> float:
    """Of the pixels that a box covers in all pictures, the share before which nothing stands; 0 for none."""
    covered = seen = 0
    for camera, depth_m in views:
        local = (corners - camera.world_from_camera[:3, 3]) @ camera.world_from_camera[:3, :3]
        if local[:, 2].min() < NEAR_M:
            continue
        at = local[:, :2] / local[:, 2:] * (camera.fx_px, camera.fy_px) + (camera.cx_px, camera.cy_px)
        if np.abs(at).max() > 1e5:
            continue
        mask = np.zeros(depth_m.shape, np.uint8)
        cv2.fillConvexPoly(mask, cv2.convexHull(np.floor(at).astype(np.int32)), 1)
        inside = mask > 0
        before = (depth_m > 0) & (depth_m < local[:, 2].min() - _MARGIN_M)
        covered += int(inside.sum())
        seen += int((inside & ~before).sum())
    return seen / covered if covered else 0.0


def level_of(share: float) -> int:
    """The level of visibility in nuScenes' words: 1 below 40 %, 2 to 60, 3 to 80, 4 above."""
    return 1 + int(np.searchsorted([0.4, 0.6, 0.8], share, side="right"))


def _points(camera: Camera, depth_m: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "n 3"]:
    rows, columns = np.nonzero(depth_m[::_STRIDE_PX, ::_STRIDE_PX])
    rows, columns = _STRIDE_PX * rows, _STRIDE_PX * columns
    depth = depth_m[rows, columns].astype(np.float64)
    return camera.lift(np.column_stack([columns + 0.5, rows + 0.5, depth]))
