"""Planners that extrapolate."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan import AHEAD_RAD, constant_turn_and_acceleration, constant_velocity, stand_still

TIMES_S = np.array([-1.0, -0.5, 0.0])


def driven(speed: float, acceleration: float, turn: float, times_s: np.ndarray = TIMES_S) -> np.ndarray:
    """Poses of a car that turns and accelerates evenly and is at the origin now, by integration."""
    poses = np.zeros((len(times_s), 3))
    for axis, part in enumerate((np.cos, np.sin)):

        def velocity(t: float, part: np.ufunc = part) -> float:
            return (speed + acceleration * t) * part(AHEAD_RAD + turn * t)

        poses[:, axis] = [quad(velocity, 0, time_s)[0] for time_s in times_s]
    poses[:, 2] = AHEAD_RAD + turn * times_s
    return poses


AHEAD_S = 0.5 * np.arange(1, 7)


@given(st.floats(0, 30), st.floats(-1, 1))
def test_a_straight_drive_at_one_speed_goes_on(speed: float, sideways: float) -> None:
    poses = np.column_stack([sideways * TIMES_S, speed * TIMES_S, np.full(3, AHEAD_RAD)])
    plan = constant_velocity(poses, TIMES_S)
    np.testing.assert_allclose(plan.waypoints_m[:, 0], sideways * AHEAD_S, atol=1e-9)
    np.testing.assert_allclose(plan.waypoints_m[:, 1], speed * AHEAD_S, atol=1e-9)


@given(st.floats(0, 30), st.floats(-0.8, 0.8))
def test_an_arc_at_one_speed_goes_on_exactly(speed: float, turn: float) -> None:
    plan = constant_turn_and_acceleration(driven(speed, 0.0, turn), TIMES_S)
    np.testing.assert_allclose(plan.waypoints_m, driven(speed, 0.0, turn, AHEAD_S)[:, :2], atol=1e-6)


@given(st.floats(5, 30), st.floats(-1, 3))
def test_a_straight_drive_at_one_acceleration_goes_on_exactly(speed: float, acceleration: float) -> None:
    plan = constant_turn_and_acceleration(driven(speed, acceleration, 0.0), TIMES_S)
    np.testing.assert_allclose(plan.waypoints_m, driven(speed, acceleration, 0.0, AHEAD_S)[:, :2], atol=1e-6)


@given(st.floats(5, 15), st.floats(-1, 1), st.floats(-0.3, 0.3))
def test_an_arc_at_one_acceleration_nearly_goes_on(speed: float, acceleration: float, turn: float) -> None:
    plan = constant_turn_and_acceleration(driven(speed, acceleration, turn), TIMES_S)
    truth = driven(speed, acceleration, turn, AHEAD_S)[:, :2]
    assert np.linalg.norm(plan.waypoints_m - truth, axis=1).max() < 0.1


def test_who_brakes_stops_and_does_not_come_back() -> None:
    plan = constant_turn_and_acceleration(driven(4.0, -4.0, 0.0), TIMES_S)
    np.testing.assert_allclose(plan.waypoints_m[:, 1], [1.5, 2, 2, 2, 2, 2], atol=1e-9)


def test_who_drives_backwards_goes_on_backwards_until_it_stops() -> None:
    plan = constant_turn_and_acceleration(driven(-2.0, 0.0, 0.2), TIMES_S)
    assert plan.waypoints_m[-1, 1] < -5
    slowing = constant_turn_and_acceleration(driven(-2.0, 2.0, 0.0), TIMES_S)
    np.testing.assert_allclose(slowing.waypoints_m[:, 1], [-0.75, -1, -1, -1, -1, -1], atol=1e-9)


def test_a_turn_across_the_border_of_angles_is_small() -> None:
    poses = driven(5.0, 0.0, 0.4)
    poses[:, 2] += np.array([2 * np.pi, 0, -2 * np.pi])
    np.testing.assert_allclose(
        constant_turn_and_acceleration(poses, TIMES_S).waypoints_m,
        constant_turn_and_acceleration(driven(5.0, 0.0, 0.4), TIMES_S).waypoints_m,
        atol=1e-9,
    )


def test_who_stands_stays() -> None:
    assert not stand_still().waypoints_m.any()
    assert not constant_velocity(driven(0.0, 0.0, 0.0), TIMES_S).waypoints_m.any()
    assert stand_still(4, 0.25).times_s.tolist() == [0.25, 0.5, 0.75, 1.0]


def test_uneven_times_are_taken_as_they_are() -> None:
    times_s = np.array([-0.9, -0.3, 0.0])
    plan = constant_turn_and_acceleration(driven(8.0, 1.0, 0.0, times_s), times_s)
    np.testing.assert_allclose(plan.waypoints_m[:, 1], 8 * AHEAD_S + AHEAD_S**2 / 2, atol=1e-6)


def test_too_few_poses_are_refused() -> None:
    with pytest.raises(InputError, match="1 past poses"):
        constant_velocity(np.zeros((1, 3)), np.zeros(1))
    with pytest.raises(InputError, match="expected 3 or more"):
        constant_turn_and_acceleration(np.zeros((2, 3)), TIMES_S[:2])
    with pytest.raises(InputError, match="times that increase"):
        constant_velocity(np.zeros((2, 3)), np.zeros(2))
