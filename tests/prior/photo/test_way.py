"""Where a photo is driven into."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.prior.photo.way import free_m, level_axes, path_for
from dreamdrive.scene.control import Command, Control, Goal
from dreamdrive.scene.geometry import Ground
from tests.prior.photo.streets import CAR, CAR_M, HEIGHT, HEIGHT_M, WIDTH, street

TIMES_S = np.arange(25) / 10


def test_the_way_ends_before_the_car_ahead() -> None:
    photo = street()
    assert free_m(photo) == pytest.approx(CAR_M, abs=0.1)
    path = path_for(Control(), photo, TIMES_S)
    assert 0 < path.positions_m[-1, 2] <= CAR_M - 4 + 1e-6
    np.testing.assert_allclose(path.positions_m[:, :2], 0, atol=1e-9)
    clear = replace(photo, depth_m=np.where(photo.road_users > 0, 30, photo.depth_m).astype(np.float32))
    assert path_for(Control(), clear, TIMES_S).positions_m[-1, 2] == pytest.approx(2.4 * 6)


def test_left_right_stop_and_a_goal() -> None:
    photo = street()
    left = path_for(Control(action=Command("left")), photo, TIMES_S).positions_m[-1]
    right = path_for(Control(action=Command("right")), photo, TIMES_S).positions_m[-1]
    assert left[0] < -0.3
    assert right[0] == pytest.approx(-left[0])
    stop = path_for(Control(action=Command("stop")), photo, TIMES_S).positions_m
    assert np.linalg.norm(stop[-1] - stop[-2]) < 1e-3
    aim = Goal(0.6, 45.5 / HEIGHT)
    there = path_for(Control(action=aim), photo, np.arange(21) / 10).positions_m[-1]
    depth_m = photo.ground.depth_m(photo.camera)[45, int(0.6 * WIDTH)]
    np.testing.assert_allclose(there[2], depth_m, rtol=0.02)
    assert there[0] > 0
    with pytest.raises(InputError, match="no point of the road"):
        path_for(Control(action=Goal(0.5, 0.2)), photo, TIMES_S)


def test_a_camera_that_looks_down_is_driven_along_the_road() -> None:
    tilted = Ground(np.array([0.0, -np.cos(0.2), -np.sin(0.2)]), HEIGHT_M)
    photo = replace(street(), ground=tilted)
    path = path_for(Control(), photo, TIMES_S)
    np.testing.assert_allclose(tilted.height_m(path.positions_m), HEIGHT_M, atol=1e-9)
    axes = level_axes(tilted)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert CAR[0].stop < HEIGHT
