"""What a lidar would have seen."""

import numpy as np

from dreamdrive.export.lidar import EGO_FROM_LIDAR, turned
from dreamdrive.scene.camera import Camera

AHEAD = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]])
CAMERA = Camera(100.0, 100.0, 80.0, 60.0, 160, 120, AHEAD)


def wall(depth_m: float) -> np.ndarray:
    return np.full((120, 160), depth_m)


def test_points_lie_on_what_is_seen_and_on_beams():
    points = turned([(CAMERA, wall(20.0))], EGO_FROM_LIDAR)
    world = points @ EGO_FROM_LIDAR[:3, :3].T + EGO_FROM_LIDAR[:3, 3]
    assert len(points) > 500
    np.testing.assert_allclose(world[:, 0], 20.0, atol=1e-6)
    up = np.rad2deg(np.arcsin(points[:, 2] / np.linalg.norm(points, axis=1)))
    assert len(np.unique(np.round((up + 30.67) / (41.34 / 31)))) > 10
    turn = np.floor((np.rad2deg(np.arctan2(points[:, 1], points[:, 0])) + 180) * 3)
    beams = np.round((up + 30.67) / (41.34 / 31))
    assert len(np.unique(np.column_stack([turn, beams]), axis=0)) == len(points)


def test_nothing_is_measured_in_the_sky_and_far_away():
    assert len(turned([(CAMERA, wall(0.0))], EGO_FROM_LIDAR)) == 0
    assert len(turned([(CAMERA, wall(200.0))], EGO_FROM_LIDAR)) == 0
    assert turned([], EGO_FROM_LIDAR).shape == (0, 3)
