import math

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.tasks.environment.bicycle import EgoOptions, EgoState, driven

FREE = EgoOptions(lateral_m_s2=1e6, steer_rad_s=1e6)


def finely(
    state: EgoState, acceleration: float, steering: float, step_s: float, options: EgoOptions
) -> EgoState:
    """The same step in many small ones."""
    for _ in range(4000):
        state = driven(state, acceleration, steering, step_s / 4000, options)
    return state


@pytest.mark.parametrize("acceleration", [0.0, 0.7, -0.5])
@pytest.mark.parametrize("steering", [0.0, 0.3, -1.0])
def test_a_step_is_as_exact_as_thousands(acceleration: float, steering: float) -> None:
    start = EgoState(3.0, -2.0, 0.7, 6.0, steering * FREE.steer_rad)
    one, many = (f(start, acceleration, steering, 0.5, FREE) for f in (driven, finely))
    for name in ("x_m", "y_m", "yaw_rad", "speed_m_s", "steer_rad"):
        assert getattr(one, name) == pytest.approx(getattr(many, name), abs=1e-6), name


def test_a_circle_closes() -> None:
    state = EgoState(0.0, 0.0, 0.0, 5.0, 0.2)
    around_s = 2 * math.pi * FREE.wheelbase_m / math.tan(0.2) / 5.0
    for _ in range(7):
        state = driven(state, 0.0, 0.2 / FREE.steer_rad, around_s / 7, FREE)
    assert (state.x_m, state.y_m) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert state.yaw_rad == pytest.approx(2 * math.pi)


def test_a_car_stops_where_it_should_and_stays() -> None:
    state = driven(EgoState(0.0, 0.0, 0.0, 3.0), -1.0, 0.0, 1.0, FREE)
    assert state.x_m == pytest.approx(3.0**2 / (2 * FREE.brake_m_s2))
    assert state.speed_m_s == 0.0
    assert state.acceleration_m_s2 == pytest.approx(-3.0)
    assert driven(state, -1.0, 1.0, 1.0, FREE).x_m == state.x_m


def test_it_drives_no_faster_than_its_top_speed() -> None:
    options = EgoOptions(top_speed_m_s=10.0)
    state = driven(EgoState(0.0, 0.0, 0.0, 9.0), 1.0, 0.0, 1.0, options)
    assert state.speed_m_s == 10.0
    assert state.x_m == pytest.approx(9.5 / 3 + 10.0 * (1 - 1 / 3))


def test_wheels_turn_in_time_and_left_is_left() -> None:
    options = EgoOptions(steer_rad_s=0.5)
    state = driven(EgoState(0.0, 0.0, 0.0, 5.0), 0.0, 1.0, 0.1, options)
    assert state.steer_rad == pytest.approx(0.05)
    assert state.y_m > 0
    assert state.yaw_rad > 0
    assert state.yaw_rate_rad_s(options) > 0


def test_at_speed_the_tyres_limit_the_curve() -> None:
    options = EgoOptions(lateral_m_s2=4.0, steer_rad_s=100.0)
    state = driven(EgoState(0.0, 0.0, 0.0, 20.0), 0.0, -1.0, 0.1, options)
    assert state.speed_m_s * state.yaw_rate_rad_s(options) == pytest.approx(-4.0)


def test_a_car_that_hardly_moves_turns_its_wheels() -> None:
    """The square of its speed is 0."""
    state = driven(EgoState(0.0, 0.0, 0.0, 1e-200), 0.0, 1.0, 0.1, EgoOptions())
    assert state.steer_rad == pytest.approx(0.07)
    assert 0 < state.x_m < 1e-199


def test_the_rectangle_lies_around_the_middle_of_the_car() -> None:
    options = EgoOptions()
    found = EgoState(1.0, 2.0, math.pi / 2, 0.0).rectangle(options)
    np.testing.assert_allclose(found, [1.0, 2.0 + options.middle_ahead_m, 4.084, 1.85, math.pi / 2])


@pytest.mark.parametrize(
    "changed",
    [
        {"width_m": 0.0},
        {"steer_rad": 1.6},
        {"brake_m_s2": -1.0},
        {"camera_ahead_m": math.nan},
        {"wheelbase_m": 1e-300},
        {"top_speed_m_s": 1e300},
    ],
)
def test_what_is_no_car_is_refused(changed: dict[str, float]) -> None:
    with pytest.raises(InputError, match="expected"):
        EgoOptions(**changed)
