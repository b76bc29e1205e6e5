"""How much of a box is seen."""

import numpy as np
import pytest

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.visibility import level_of, share_seen

AHEAD = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]])
CAMERA = Camera(100.0, 100.0, 80.0, 60.0, 160, 120, AHEAD)


def wall(depth_m: float) -> np.ndarray:
    return np.full((120, 160), depth_m)


def box(x: float, y: float, z: float, size: float = 2.0) -> np.ndarray:
    signs = np.array([[a, b, c] for a in (1, -1) for b in (1, -1) for c in (1, -1)])
    return np.array([x, y, z]) + signs * size / 2


@pytest.mark.parametrize(("depth_m", "share"), [(30.0, 1.0), (5.0, 0.0), (0.0, 1.0)])
def test_what_stands_before_a_box_hides_it(depth_m, share):
    assert share_seen(box(15, 0, 1.5), [(CAMERA, wall(depth_m))]) == share


def test_half_a_box_is_half_seen():
    depth = wall(30.0)
    depth[:, :80] = 5.0
    assert share_seen(box(15, 0, 1.5), [(CAMERA, depth)]) == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(
    ("depth_m", "margin", "share"), [(12.0, 0.0, 0.0), (12.0, 0.2, 1.0), (10.0, 0.2, 0.0)]
)
def test_reconstructed_depth_is_wrong_by_a_share_of_the_distance(depth_m, margin, share):
    assert share_seen(box(15, 0, 1.5), [(CAMERA, wall(depth_m))], margin) == share


def test_a_box_behind_the_camera_is_not_seen():
    assert share_seen(box(-15, 0, 1.5), [(CAMERA, wall(30.0))]) == 0.0


def test_levels():
    assert [level_of(share) for share in (0.0, 0.39, 0.4, 0.6, 0.79, 0.8, 1.0)] == [1, 1, 2, 3, 3, 4, 4]
