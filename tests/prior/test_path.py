"""Paths become waypoints, and actions the paths they ask for."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.prior.path import (
    STEERING_RATIO,
    WHEEL_BASE_M,
    asked_path,
    from_first,
    path_of,
    waypoints_by_round,
)
from dreamdrive.scene.control import AT_S, Goal, Steering, Waypoints, check_action
from dreamdrive.scene.trajectory import Trajectory
from tests.prior.paths import circle

TIMES_S = np.arange(25) / 10
quick = settings(max_examples=40)


def four(least: float, most: float) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[st.floats(least, most)] * 4)


def waypoints(path: Trajectory) -> Waypoints:
    """Of a single round."""
    return waypoints_by_round(path, np.zeros(1), 0.0)[0]


@quick
@given(four(-20, 20), four(0, 90))
def test_waypoints_survive_the_way_there_and_back(right, ahead):
    action = Waypoints(right_m=right, ahead_m=ahead)
    back = waypoints(path_of(action, TIMES_S))
    np.testing.assert_allclose(back.right_m, right, atol=1e-9)
    np.testing.assert_allclose(back.ahead_m, ahead, atol=1e-9)


@quick
@given(st.floats(3, 30), four(-1, 1), four(-2, 2))
def test_the_path_of_steering_has_its_speeds_and_its_turns(speed, change, wheel):
    """As well as differences of poses at 100 Hz tell them."""
    speed = tuple(speed + each for each in change)
    path = path_of(Steering(speed_m_s=speed, wheel_rad=wheel), np.arange(241) / 100)
    at = [round(100 * t) for t in AT_S]
    found = np.linalg.norm(np.gradient(path.positions_m, path.times_s, axis=0), axis=1)
    np.testing.assert_allclose(found[at], speed, atol=0.03)
    ahead = path.world_from_camera[:, :3, 2]
    left_rad = np.unwrap(np.arctan2(-ahead[:, 0], ahead[:, 2]))
    left_per_m = np.tan(np.array(wheel) / STEERING_RATIO) / WHEEL_BASE_M
    np.testing.assert_allclose(
        np.gradient(left_rad, path.times_s)[at], left_per_m * np.array(speed), atol=0.03
    )


@quick
@given(st.floats(1, 40), st.floats(-0.1, 0.1))
def test_a_steady_wheel_drives_a_circle(speed, left_per_m):
    wheel = STEERING_RATIO * np.arctan(WHEEL_BASE_M * left_per_m)
    found = path_of(Steering((speed,) * 4, (float(wheel),) * 4), TIMES_S)
    expected = circle(speed, left_per_m).world_from_camera
    np.testing.assert_allclose(found.world_from_camera, expected, atol=1e-3)


@quick
@given(st.floats(1, 40), st.floats(-0.1, 0.1), st.floats(-3, 3), st.floats(-50, 50), st.floats(0, 99))
def test_a_circle_has_its_waypoints_wherever_it_starts(speed, left_per_m, turn, shift, since):
    left_per_m /= max(1.0, (speed / 9) ** 2)  # sideways at most 8.1 m/s2
    path = circle(speed, left_per_m, rate_hz=50)
    world = np.eye(4)
    world[:3, :3] = Rotation.from_rotvec([0.1, turn, 0.2]).as_matrix()
    world[:3, 3] = shift, 2.0, -shift
    at, there = (
        waypoints(each) for each in (path, Trajectory(world @ path.world_from_camera, path.times_s + since))
    )
    np.testing.assert_allclose([*at.right_m, *at.ahead_m], [*there.right_m, *there.ahead_m], atol=1e-9)


def test_a_straight_drive():
    path = circle(8.0)
    assert waypoints(path).ahead_m == pytest.approx([8 * t for t in AT_S])
    assert waypoints(path).right_m == pytest.approx([0] * 4)


def test_a_turn_to_the_left_is_to_the_left():
    assert waypoints(circle(8.0, 0.05)).right_m[-1] < 0
    turned = path_of(Steering((8.0,) * 4, (1.0,) * 4), TIMES_S)
    assert turned.positions_m[-1, 0] < 0
    assert turned.world_from_camera[-1, 0, 2] < 0


def test_paths_that_cannot_be_driven_are_refused():
    with pytest.raises(InputError, match="lasts 1 s; expected at least 2 s for these frames"):
        waypoints(circle(5.0, seconds=1.0))
    with pytest.raises(InputError, match="no car drives it, an action outside its range: ahead_m is 120"):
        waypoints(circle(60.0))


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


def test_each_round_is_told_the_path_from_where_it_starts():
    """On a circle that looks the same from everywhere."""
    path = circle(8.0, 0.03, seconds=5.0, rate_hz=20)
    first, second = waypoints_by_round(path, np.array([0.0, 2.2]), 4.6)
    expected = waypoints(path)
    for made in (first, second):
        np.testing.assert_allclose(made.ahead_m, expected.ahead_m, atol=5e-3)
        np.testing.assert_allclose(made.right_m, expected.right_m, atol=5e-3)
    assert first == expected


def test_the_path_has_to_lead_to_the_last_frame():
    path = circle(8.0, seconds=2.2)
    assert len(waypoints_by_round(path, np.array([0.0]), 1.0)) == 1
    with pytest.raises(InputError, match=r"lasts 2.2 s; expected at least 2.4 s for these frames"):
        waypoints_by_round(path, np.array([0.0]), 2.4)
    with pytest.raises(InputError, match=r"expected at least 4.2 s"):
        waypoints_by_round(path, np.array([0.0, 2.2]), 2.9)


def test_the_path_of_the_frames_starts_at_the_first_of_them():
    asked = asked_path(circle(8.0, 0.03), np.array([0.5, 1.0]))
    np.testing.assert_allclose(
        asked.world_from_camera, circle(8.0, 0.03).world_from_camera[[0, 5]], atol=1e-9
    )
    np.testing.assert_allclose(asked.times_s, [0, 0.5])


def test_numbers_outside_their_ranges_are_named():
    check_action(Goal(0.0, 1.0))
    with pytest.raises(InputError, match=r"row is 1.2; expected 0 to 1"):
        check_action(Goal(0.5, 1.2))
    with pytest.raises(InputError, match=r"speed_m_s is nan"):
        check_action(Steering((1, 2, float("nan"), 4), (0, 0, 0, 0)))
