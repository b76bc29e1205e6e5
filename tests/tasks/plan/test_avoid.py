import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from dreamdrive.tasks.plan import CAR, AvoidOptions, Plan, avoid, headings, overlapping

AHEAD = np.column_stack([np.zeros(6), 4.0 * np.arange(1, 7)])  # 8 m/s
NOTHING = np.zeros((0, 2))


def wall(x_m: tuple[float, float], y_m: float) -> np.ndarray:
    """Cells side by side."""
    xs = np.arange(x_m[0], x_m[1] + 0.1, 0.5)
    return np.column_stack([xs, np.full(len(xs), y_m)])


def touches(waypoints_m: np.ndarray, cells_m: np.ndarray) -> bool:
    """Whether the car covers a part of a cell at any waypoint, by rectangles of the cells."""
    cars = CAR.along(waypoints_m)
    cells = np.column_stack([cells_m, np.full((len(cells_m), 2), 0.35), np.zeros(len(cells_m))])
    return bool(overlapping(cars[:, None], cells).any())


def test_what_is_clear_stays_as_it_is() -> None:
    plan = Plan(AHEAD)
    for cells in (NOTHING, wall((4.0, 6.0), 12.0), wall((-1, 1), 40.0)):
        found = avoid(plan, 8.0, [cells] * 12)
        assert found.plan is plan
        assert not found.changed
        assert found.clear_before_m == found.clear_after_m


def test_the_distance_is_that_of_the_rectangle_to_the_cell() -> None:
    ahead = avoid(Plan(AHEAD), 8.0, [NOTHING] * 11 + [wall((0, 0), 24 + 0.5 + 4.084 / 2 + 1.25)])
    assert ahead.clear_before_m == pytest.approx(1.0, abs=1e-6)
    beside = avoid(Plan(AHEAD), 8.0, [NOTHING] * 11 + [wall((1.85 / 2 + 0.75,) * 2, 24.0)])
    assert beside.clear_before_m == pytest.approx(0.5, abs=1e-6)


def test_it_brakes_before_a_wall() -> None:
    found = avoid(Plan(AHEAD), 8.0, [wall((-8, 8), 16.0)] * 12)
    assert found.clear_before_m < 0 < found.clear_after_m
    steps_m = np.diff(np.concatenate([[0.0], found.plan.waypoints_m[:, 1]]))
    assert (np.diff(steps_m) < 1e-6).all()
    assert (steps_m > -1e-9).all()
    assert np.abs(found.plan.waypoints_m[:, 0]).max() < 0.5


def test_it_swerves_around_what_stands_half_in_the_way() -> None:
    found = avoid(Plan(AHEAD), 8.0, [wall((0.75, 1.75), 14.0)] * 12)
    assert found.clear_before_m < 0 < found.clear_after_m
    assert found.plan.waypoints_m[-1, 0] < -0.3
    assert found.plan.waypoints_m[-1, 1] > 22


def test_it_lets_pass_what_crosses() -> None:
    times_s = 0.25 * np.arange(1, 13)
    crossing = [wall((-10 + 4.0 * t, -6 + 4.0 * t), 14.0) for t in times_s]
    found = avoid(Plan(AHEAD), 8.0, crossing)
    assert found.clear_before_m < 0 < found.clear_after_m


def test_a_car_that_stands_stays_where_it_is() -> None:
    found = avoid(Plan(np.zeros((6, 2))), 0.0, [wall((-1, 1), 5.0)] * 6)
    assert not found.changed
    assert found.clear_before_m == pytest.approx(5.0 - 0.25 - 0.5 - 4.084 / 2)


def test_it_keeps_away_from_what_is_ahead_the_more_the_later_it_is() -> None:
    # The front comes to 26.5 m in three seconds, and others may brake.
    near, far = (avoid(Plan(AHEAD), 8.0, [wall((-1, 1), y_m)] * 12) for y_m in (28.0, 30.5))
    assert near.changed
    assert near.clear_before_m > 0
    assert near.clear_after_m > near.clear_before_m
    assert not far.changed
    trusting = avoid(Plan(AHEAD), 8.0, [wall((-1, 1), 28.0)] * 12, AvoidOptions(unsure_ahead_m_s=0.0))
    assert not trusting.changed


def test_obstacles_come_with_every_waypoint() -> None:
    with pytest.raises(ValueError, match="expected a multiple"):
        avoid(Plan(AHEAD), 8.0, [NOTHING] * 7)


@settings(max_examples=25)
@example(11.0, 0.125, [(0.0, 8.0), (0.0, 11.0)])  # nothing is clear: it touches at fewer times
@example(1.0, 0.0, [(1.0, 8.0)])  # all is clear: more room ahead for less beside
@given(
    st.floats(1, 14),
    st.floats(-0.15, 0.15),
    st.lists(st.tuples(st.floats(-3, 3), st.floats(8, 30)), min_size=1, max_size=4),
)
def test_the_new_drive_is_one_of_a_car_and_clear_where_it_can_be(
    speed_m_s: float, turn_rad_s: float, middles: list[tuple[float, float]]
) -> None:
    times_s = 0.5 * np.arange(1, 7)
    yaw = np.pi / 2 + turn_rad_s * times_s / 2
    plan = Plan(speed_m_s * times_s[:, None] * np.column_stack([np.cos(yaw), np.sin(yaw)]))
    cells = np.concatenate([wall((x - 1, x + 1), y) for x, y in middles])
    found = avoid(plan, speed_m_s, [cells] * 12)
    if found.clear_before_m >= 0:
        assert found.clear_after_m >= 0  # less room at its side may be worth more ahead
        assert not avoid(plan, speed_m_s, [cells] * 12, AvoidOptions(unsure_ahead_m_s=0.0)).changed
    if found.clear_after_m > 0.1:
        assert not touches(found.plan.waypoints_m, cells)
    path = np.concatenate([np.zeros((1, 2)), found.plan.waypoints_m])
    speeds = np.linalg.norm(np.diff(path, axis=0), axis=1) / 0.5
    assert (np.abs(np.diff(speeds)) / 0.5 < 9.5).all()
    assert np.abs(np.diff(headings(found.plan.waypoints_m))).max(initial=0) < 0.6
