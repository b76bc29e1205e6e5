"""Paths of a car for tests: at a steady speed, straight or on a circle."""

import numpy as np
from scipy.spatial.transform import Rotation

from dreamdrive.scene.trajectory import Trajectory


def circle(
    speed_m_s: float, left_per_m: float = 0.0, seconds: float = 2.4, rate_hz: float = 10
) -> Trajectory:
    """A path that starts at the origin along z and turns by ``left_per_m`` radians a metre."""
    times_s = np.arange(round(seconds * rate_hz) + 1) / rate_hz
    travelled = speed_m_s * times_s
    left_rad = left_per_m * travelled
    poses = np.tile(np.eye(4), (len(times_s), 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(np.outer(-left_rad, [0, 1, 0])).as_matrix()
    if left_per_m:
        poses[:, 0, 3] = (np.cos(left_rad) - 1) / left_per_m
        poses[:, 2, 3] = np.sin(left_rad) / left_per_m
    else:
        poses[:, 2, 3] = travelled
    return Trajectory(poses, times_s)
