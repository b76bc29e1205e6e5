import numpy as np
import pytest

from dreamdrive.tasks.environment.bicycle import EgoOptions, EgoState
from dreamdrive.tasks.environment.course import course_of
from dreamdrive.tasks.environment.observation import HIGH, LOW, NAMES, ROAD_USERS, LastAction, vector_of
from dreamdrive.tasks.environment.road_users import RoadUserStates
from tests.tasks.environment.scenes import scene

EGO = EgoOptions()
NOTHING = LastAction()
PATH = course_of(scene(), "a scene", None, EGO, 0.5).path


def road_users(*boxes: tuple[float, ...], there: tuple[bool, ...] | None = None) -> RoadUserStates:
    rows = np.array(boxes, dtype=float).reshape(-1, 6)
    known = np.ones(len(rows), dtype=bool) if there is None else np.array(there)
    return RoadUserStates(rows[:, :5], rows[:, 5], np.zeros(len(rows)), known)


def told(state: EgoState, seen: RoadUserStates, action: LastAction = NOTHING) -> dict[str, float]:
    vector = vector_of(state, PATH.beside(state.x_m, state.y_m, state.x_m), action, PATH, seen, EGO)
    assert vector.dtype == np.float32
    assert ((vector >= LOW) & (vector <= HIGH)).all()
    return dict(zip(NAMES, vector.tolist(), strict=True))


def test_the_own_car_by_the_path() -> None:
    state = EgoState(5.0, 1.25, 0.1, 7.0, 0.2)
    found = told(state, road_users(), LastAction(0.5, -0.25))
    expected = {
        "speed_m_s": 7.0,
        "yaw_rate_rad_s": 7.0 * np.tan(0.2) / EGO.wheelbase_m,
        "acceleration": 0.5,
        "steering": -0.25,
        "aside_m": 1.25,
        "turned_rad": 0.1,
        "along_m": 6.7,
    }
    assert {name: found[name] for name in expected} == pytest.approx(expected, abs=1e-5)


def test_the_route_is_seen_from_the_car() -> None:
    found = told(EgoState(5.0, 1.0, 0.0, 7.0), road_users())
    assert (found["route_5_x_m"], found["route_5_y_m"]) == pytest.approx((5.0, -1.0), abs=1e-5)
    assert (found["route_40_x_m"], found["route_40_y_m"]) == pytest.approx((40.0, -1.0), abs=1e-5)
    turned = told(EgoState(5.0, 0.0, np.pi / 2, 7.0), road_users())
    assert (turned["route_10_x_m"], turned["route_10_y_m"]) == pytest.approx((0.0, -10.0), abs=1e-5)


def test_the_nearest_road_users_come_first_and_the_rest_is_zero() -> None:
    far, near, gone = (30.0, 3.5, 4.4, 1.8, 3.1, 9.0), (10.0, 0.0, 8.0, 2.4, 0.0, 5.0), (6.0, 0, 4, 2, 0, 1)
    found = told(EgoState(5.0, 0.0, 0.0, 7.0), road_users(far, gone, near, there=(True, False, True)))
    first = [found[f"user_0_{name}"] for name in ("there", "x_m", "y_m", "length_m", "width_m", "speed_m_s")]
    assert first == pytest.approx([1, 5, 0, 8, 2.4, 5], abs=1e-5)
    assert found["user_1_x_m"] == pytest.approx(25.0)
    assert found["user_1_heading_rad"] == pytest.approx(3.1, abs=1e-5)
    assert all(found[name] == 0 for name in NAMES if name.startswith("user_2"))


def test_no_more_than_fit_are_told() -> None:
    many = [(10.0 + k, 0.0, 4.0, 2.0, 0.0, 1.0) for k in range(ROAD_USERS + 3)]
    found = told(EgoState(0.0, 0.0, 0.0, 7.0), road_users(*many))
    assert found[f"user_{ROAD_USERS - 1}_x_m"] == pytest.approx(10.0 + ROAD_USERS - 1)


def test_what_is_beyond_its_range_is_told_as_its_end() -> None:
    found = told(EgoState(0.0, 0.0, 7.0, 7.0), road_users((500.0, 0.0, 4.0, 2.0, 0.0, 400.0)))
    assert found["user_0_x_m"] == 100.0
    assert found["user_0_speed_m_s"] == 100.0
    assert found["turned_rad"] == pytest.approx(7.0 - 2 * np.pi, abs=1e-5)
