"""Lidar simulated from the depth of cameras."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.visibility import View

BEAMS = np.linspace(-30.67, 10.67, 32)
"""Elevations in degrees: those of the Velodyne HDL-32E of nuScenes."""
_STEP_DEG = 1 / 3
_BEAM_DEG = 0.35
"""How far from its beam a pixel may lie: less than half the distance of two beams."""
_REACH_M = 70.0
_STRIDE_PX = 2
EGO_FROM_LIDAR = np.array([[0.0, 1, 0, 0.94], [-1, 0, 0, 0], [0, 0, 1, 1.84], [0, 0, 0, 1]])
"""Mounting of the lidar of nuScenes: x right, y ahead, z up."""


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


def _points(camera: Camera, depth_m: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "n 3"]:
    rows, columns = np.nonzero(depth_m[::_STRIDE_PX, ::_STRIDE_PX])
    rows, columns = _STRIDE_PX * rows, _STRIDE_PX * columns
    depth = depth_m[rows, columns].astype(np.float64)
    return camera.lift(np.column_stack([columns + 0.5, rows + 0.5, depth]))
