"""Paths become actions, and actions the paths they ask for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from tests.prior.paths import circle

from dreamdrive.errors import InputError
from dreamdrive.prior.action_to_path import path_of
from dreamdrive.prior.path_to_action import (
    STEERING_RATIO,
    WHEEL_BASE_M,
    command,
    from_first,
    goal,
    steering,
    waypoints,
)
from dreamdrive.scene.action import AT_S, Goal, Steering, Waypoints, check_action
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.trajectory import Trajectory

CAMERA = Camera(500.0, 500.0, 320.0, 180.0, 640, 360)
TIMES_S = np.arange(25) / 10
quick = settings(max_examples=40, deadline=None, derandomize=True)


def four(least: float, most: float) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[st.floats(least, most)] * 4)


@quick
@given(four(-20, 20), four(0, 90))
def test_waypoints_survive_the_way_there_and_back(right, ahead):
    action = Waypoints(right_m=right, ahead_m=ahead)
    back = waypoints(path_of(action, TIMES_S))
    np.testing.assert_allclose(back.right_m, right, atol=1e-9)
    np.testing.assert_allclose(back.ahead_m, ahead, atol=1e-9)


@quick
@given(st.floats(3, 30), four(-1, 1), four(-2, 2))
def test_steering_survives_the_way_there_and_back(speed, change, wheel):
    """As well as a spline through poses at 50 Hz follows a jerk: brakes of up to 4 m/s2."""
    speed = tuple(speed + each for each in change)
    action = Steering(speed_m_s=speed, wheel_rad=wheel)
    back = steering(path_of(action, np.arange(121) / 50))
    np.testing.assert_allclose(back.speed_m_s, speed, atol=0.03)
    np.testing.assert_allclose(back.wheel_rad, wheel, atol=0.05)


@quick
@given(st.floats(1, 40), st.floats(-0.1, 0.1), st.floats(-3, 3), st.floats(-50, 50), st.floats(0, 99))
def test_a_circle_has_its_speed_and_its_wheel_wherever_it_starts(speed, left_per_m, turn, shift, since):
    left_per_m /= max(1.0, (speed / 9) ** 2)  # sideways at most 8.1 m/s2
    path = circle(speed, left_per_m, rate_hz=50)
    world = np.eye(4)
    world[:3, :3] = Rotation.from_rotvec([0.1, turn, 0.2]).as_matrix()
    world[:3, 3] = shift, 2.0, -shift
    moved = Trajectory(world @ path.world_from_camera, path.times_s + since)
    found = steering(moved)
    np.testing.assert_allclose(found.speed_m_s, speed, rtol=1e-5)
    wheel = STEERING_RATIO * np.arctan(WHEEL_BASE_M * left_per_m)
    np.testing.assert_allclose(found.wheel_rad, wheel, atol=1e-5)
    at, there = waypoints(path), waypoints(moved)
    np.testing.assert_allclose([*at.right_m, *at.ahead_m], [*there.right_m, *there.ahead_m], atol=1e-9)


def test_a_straight_drive():
    path = circle(8.0)
    assert waypoints(path).ahead_m == pytest.approx([8 * t for t in AT_S])
    assert waypoints(path).right_m == pytest.approx([0] * 4)
    assert steering(path).wheel_rad == pytest.approx([0] * 4)


def test_a_turn_to_the_left_is_to_the_left():
    path = circle(8.0, 0.05)
    assert waypoints(path).right_m[-1] < 0 < steering(path).wheel_rad[-1]


@pytest.mark.parametrize(
    ("speed", "left_per_m", "word"),
    [(0.2, 0, "stop"), (10, 0, "forward"), (10, 0.003, "forward"), (10, 0.02, "left"), (10, -0.02, "right")],
)
def test_a_path_in_a_word(speed, left_per_m, word):
    assert command(circle(speed, left_per_m)).direction == word


def test_a_car_that_stands_has_its_wheel_straight():
    jitter = circle(0.0)
    jitter.world_from_camera[:, 2, 3] += 1e-3 * np.sin(np.arange(len(jitter)))
    found = steering(jitter)
    assert min(found.speed_m_s) >= 0
    assert found.wheel_rad == (0, 0, 0, 0)


def test_the_goal_is_the_road_under_the_end():
    found = goal(circle(10.0, seconds=2.0), CAMERA)
    assert found.column == pytest.approx(0.5)
    assert found.row == pytest.approx((180 + 500 * 1.5 / 20) / 360)
    left = goal(circle(10.0, 0.01), CAMERA)
    assert left.column < 0.5


def test_an_end_that_the_first_frame_does_not_show_is_no_goal():
    with pytest.raises(InputError, match="outside it; choose a path"):
        goal(circle(1.0), CAMERA)
    path = circle(5.0)
    back = path.world_from_camera.copy()
    back[:, 2, 3] *= -1
    with pytest.raises(InputError, match="12 m behind the first frame"):
        goal(Trajectory(back, path.times_s), CAMERA)


def test_paths_that_cannot_be_steered_by_are_refused():
    with pytest.raises(InputError, match="lasts 1 s; expected at least the 2 s"):
        waypoints(circle(5.0, seconds=1.0))
    with pytest.raises(InputError, match="no car drives it, an action outside its range: ahead_m is 120"):
        waypoints(circle(60.0))
    reverse = circle(5.0)
    reverse.world_from_camera[:, 2, 3] *= -1
    with pytest.raises(InputError, match=r"no car drives it, .* speed_m_s is -5"):
        steering(reverse)
    with pytest.raises(InputError, match="2 poses do not tell speeds"):
        steering(circle(5.0, seconds=4.0, rate_hz=0.25))


def test_the_camera_looks_along_waypoints_and_goes_on_behind_the_last():
    path = path_of(Waypoints(right_m=(0, 0, 0, 0), ahead_m=(4, 8, 12, 16)), np.array([0.0, 1.0, 3.0]))
    np.testing.assert_allclose(path.positions_m, [[0, 0, 0], [0, 0, 8], [0, 0, 24]], atol=1e-12)
    left = path_of(Waypoints(right_m=(0, -1, -2, -3), ahead_m=(4, 8, 12, 16)), TIMES_S)
    np.testing.assert_array_equal(left.world_from_camera[0], np.eye(4))
    assert left.world_from_camera[-1, 0, 2] < 0
    stands = path_of(Waypoints(right_m=(0,) * 4, ahead_m=(0,) * 4), TIMES_S)
    np.testing.assert_array_equal(stands.world_from_camera, np.tile(np.eye(4), (25, 1, 1)))
    with pytest.raises(ValueError, match="starts at time 0"):
        path_of(Waypoints(right_m=(0,) * 4, ahead_m=(0,) * 4), np.array([0.5, 1.0]))


def test_a_path_from_its_first_pose():
    path = circle(5.0, 0.03)
    later = Trajectory(path.world_from_camera[5:], path.times_s[5:])
    np.testing.assert_allclose(from_first(later).world_from_camera, path.world_from_camera[:-5], atol=1e-12)
    assert from_first(later).times_s[0] == 0


def test_numbers_outside_their_ranges_are_named():
    check_action(Goal(0.0, 1.0))
    with pytest.raises(InputError, match=r"row is 1.2; expected 0 to 1"):
        check_action(Goal(0.5, 1.2))
    with pytest.raises(InputError, match=r"speed_m_s is nan"):
        check_action(Steering((1, 2, float("nan"), 4), (0, 0, 0, 0)))
