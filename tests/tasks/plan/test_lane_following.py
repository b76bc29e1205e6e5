"""A car that follows its lane and keeps its distance."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan import IDM, IdmOptions, Lead, follow_lane

AHEAD = np.array([[0.0, -20.0], [0.0, 300.0]])


def test_on_an_empty_road_the_desired_speed_is_kept() -> None:
    plan = follow_lane(AHEAD, IDM.desired_m_s)
    np.testing.assert_allclose(plan.waypoints_m[:, 1], IDM.desired_m_s * plan.times_s, atol=1e-9)
    assert not plan.waypoints_m[:, 0].any()


def test_from_standstill_it_accelerates_as_it_may() -> None:
    plan = follow_lane(AHEAD, 0.0)
    first = plan.waypoints_m[0, 1]
    assert first == pytest.approx(IDM.acceleration_m_s2 * 0.5**2 / 2, rel=0.02)
    assert (np.diff(plan.waypoints_m[:, 1], 2) > 0).all()


def test_the_speed_settles_at_the_desired_one() -> None:
    for speed in (2.0, 25.0):
        plan = follow_lane(AHEAD, speed, steps=200)
        assert np.diff(plan.waypoints_m[:, 1])[-1] == pytest.approx(IDM.desired_m_s * 0.5, rel=0.01)


def test_the_gap_settles_at_that_of_the_model() -> None:
    """Behind a car at 8 m/s: the published gap of equal speeds."""
    lead = Lead(40.0, 8.0)
    plan = follow_lane(np.array([[0.0, 0.0], [0.0, 2000.0]]), 12.0, lead, steps=240)
    gap = lead.gap_m + lead.speed_m_s * plan.times_s[-1] - plan.waypoints_m[-1, 1]
    wanted = (IDM.least_gap_m + 8.0 * IDM.headway_s) / np.sqrt(1 - (8.0 / IDM.desired_m_s) ** IDM.exponent)
    assert gap == pytest.approx(wanted, rel=0.01)


@given(st.floats(0, 15), st.floats(15, 80), st.floats(0, 15))
def test_it_never_reaches_the_car_ahead_and_never_goes_back(
    speed: float, gap_m: float, lead_speed: float
) -> None:
    lead = Lead(gap_m, lead_speed)
    plan = follow_lane(AHEAD, speed, lead, steps=40)
    ways = plan.waypoints_m[:, 1]
    assert (np.diff(ways) >= -1e-9).all()
    assert (ways <= gap_m + lead_speed * plan.times_s + 1e-6).all()


def test_it_stops_behind_what_stands() -> None:
    plan = follow_lane(AHEAD, 10.0, Lead(30.0, 0.0), steps=60)
    assert plan.waypoints_m[-1, 1] == pytest.approx(30 - IDM.least_gap_m, abs=1.0)
    assert np.diff(plan.waypoints_m[:, 1])[-1] < 0.02


def test_braking_has_a_limit() -> None:
    plan = follow_lane(AHEAD, 20.0, Lead(1.0, 0.0))
    hardest = IDM.hardest_m_s2
    assert plan.waypoints_m[0, 1] == pytest.approx(20 * 0.5 - hardest * 0.5**2 / 2)
    assert plan.waypoints_m[-1, 1] == pytest.approx(20**2 / 2 / hardest, rel=0.01)


def test_it_follows_the_bend_at_its_pace() -> None:
    angle = np.linspace(0, np.pi / 2, 400)
    bend = 30 * np.column_stack([1 - np.cos(angle), np.sin(angle)])
    plan = follow_lane(bend, 10.0, options=IdmOptions(desired_m_s=10.0))
    from_middle = np.linalg.norm(plan.waypoints_m - [30.0, 0.0], axis=1)
    np.testing.assert_allclose(from_middle, 30.0, atol=0.01)
    turned = np.arctan2(plan.waypoints_m[:, 1], 30 - plan.waypoints_m[:, 0])
    np.testing.assert_allclose(turned, 10 * plan.times_s / 30, atol=0.001)


def test_from_beside_the_lane_it_comes_onto_it() -> None:
    line = AHEAD + np.array([1.5, 0.0])
    plan = follow_lane(line, 10.0, options=IdmOptions(desired_m_s=10.0))
    assert (np.diff(plan.waypoints_m[:, 0]) >= 0).all()
    assert 0 < plan.waypoints_m[0, 0] < 0.4
    assert plan.waypoints_m[-1, 0] == pytest.approx(1.5)
    still = follow_lane(line, 0.0, Lead(0.5, 0.0))
    np.testing.assert_allclose(still.waypoints_m, 0, atol=1e-12)


def test_behind_the_end_of_the_line_it_goes_straight_on() -> None:
    short = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0]])
    plan = follow_lane(short, 10.0)
    np.testing.assert_allclose(plan.waypoints_m[:, 0], plan.waypoints_m[:, 1], atol=1e-9)
    assert plan.waypoints_m[-1, 0] > 15


@pytest.mark.parametrize("line", [np.zeros((0, 2)), np.zeros((3, 2)), np.array([[0.0, 0.0], [0.0, np.nan]])])
def test_a_line_of_no_length_is_refused(line: np.ndarray) -> None:
    with pytest.raises(InputError, match="a centre line of"):
        follow_lane(line, 5.0)


def test_numbers_that_are_none_are_refused() -> None:
    with pytest.raises(InputError, match="a speed of -1"):
        follow_lane(AHEAD, -1.0)
    with pytest.raises(InputError, match="expected finite numbers"):
        follow_lane(AHEAD, 1.0, Lead(np.nan, 0.0))
    with pytest.raises(InputError, match="above 0"):
        IdmOptions(braking_m_s2=0.0)
    with pytest.raises(InputError, match="headway_s"):
        IdmOptions(headway_s=-1.0)
