import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.tasks.environment.bicycle import EgoOptions
from dreamdrive.tasks.environment.course import course_of
from dreamdrive.tasks.environment.road_users import RoadUsers
from dreamdrive.tasks.environment.traffic import Traffic, TrafficOptions
from tests.tasks.environment.scenes import AHEAD, BEHIND, ONCOMING, SPEED_M_S, Path, scene

EGO = EgoOptions()
REACT = TrafficOptions()


def road_users(*paths: Path, **more: object) -> RoadUsers:
    return course_of(scene(*paths, **more), "a scene", None, EGO, 0.5).road_users  # type: ignore[arg-type]


def at(x_m: float, y_m: float = 0.0) -> np.ndarray:
    return np.array([x_m, y_m, EGO.length_m, EGO.width_m, 0.0])


def played(traffic: Traffic, until_s: float, ego: np.ndarray, speed_m_s: float, start_s: float = 0.0) -> None:
    """Time passes while the own car drives straight on from a place."""
    traffic.start(start_s)
    for step in range(1, round((until_s - start_s) * 10) + 1):
        moved = ego.copy()
        moved[0] += speed_m_s * (step - 1) * 0.1
        traffic.step(round(start_s + 0.1 * step, 6), moved, speed_m_s)


def test_actors_are_boxes_in_the_level_frame() -> None:
    states = road_users(AHEAD, ONCOMING).states(np.array([1.0, 1.0]))
    np.testing.assert_allclose(states.boxes[0], [14 + SPEED_M_S, 0, 4.4, 1.8, 0], atol=1e-6)
    np.testing.assert_allclose(states.boxes[1, :2], [51.0, 3.5], atol=1e-6)
    assert abs(states.boxes[1, 4]) == pytest.approx(np.pi)
    np.testing.assert_allclose(states.speeds_m_s, [SPEED_M_S, 9.0], rtol=1e-6)
    assert states.there.all()


def test_each_is_at_a_time_of_its_own_and_between_frames() -> None:
    states = road_users(AHEAD, ONCOMING).states(np.array([0.25, 2.71]))
    assert states.boxes[0, 0] == pytest.approx(14 + 0.25 * SPEED_M_S)
    assert states.boxes[1, 0] == pytest.approx(60 - 2.71 * 9.0)


def test_after_the_recording_they_go_on_at_a_constant_rate() -> None:
    states = road_users(AHEAD).states(np.array([5.5]))
    assert states.boxes[0, 0] == pytest.approx(14 + 5.5 * SPEED_M_S, abs=1e-6)
    assert states.ways_m[0] == pytest.approx(5.5 * SPEED_M_S, abs=1e-6)
    assert states.there[0]


def test_nothing_is_known_before_and_after_it_was_seen() -> None:
    known = road_users(AHEAD, seen_s=(0.5, 1.5))
    there = [bool(known.states(np.array([t])).there[0]) for t in (0.4, 0.5, 1.5, 1.6, 9.0)]
    assert there == [False, True, True, False, False]


def test_a_box_that_the_recorded_car_drove_through_cannot_be_hit() -> None:
    assert road_users((3.5, 0.0, SPEED_M_S, 0.0), AHEAD).solid.tolist() == [False, True]


def test_as_recorded_nothing_reacts() -> None:
    traffic = Traffic(road_users(BEHIND), None)
    played(traffic, 3.0, at(-4.0), 0.0)
    assert traffic.states.boxes[0, 0] == pytest.approx(-12 + 3 * SPEED_M_S)
    np.testing.assert_allclose(traffic.clocks_s, 3.0)


def test_who_follows_a_car_that_stands_stops_behind_it() -> None:
    known = road_users(BEHIND)
    traffic = Traffic(known, REACT)
    played(traffic, 8.0, at(12.0), 0.0)
    front_m = traffic.states.boxes[0, 0] + 2.2
    assert traffic.states.speeds_m_s[0] < 0.3
    assert 0.5 < (12.0 - EGO.length_m / 2) - front_m < 8.0
    assert traffic.clocks_s[0] < 5.0


def test_it_never_hits_the_car_and_goes_on_when_that_goes_on() -> None:
    traffic = Traffic(road_users(BEHIND), REACT)
    traffic.start(0.0)
    gaps: list[float] = []
    speeds: list[float] = []
    for step in range(1, 121):
        ego = at(12.0 if step < 70 else 12.0 + (step - 70) * 0.8)
        traffic.step(round(0.1 * step, 6), ego, 0.0 if step < 70 else 8.0)
        gaps.append(ego[0] - traffic.states.boxes[0, 0] - 2.2 - EGO.length_m / 2)
        speeds.append(float(traffic.states.speeds_m_s[0]))
    assert min(gaps) > 0
    assert min(speeds[40:70]) < 0.5
    assert speeds[-1] > 4.0


def test_what_drives_as_it_was_recorded_is_no_reason_to_brake() -> None:
    known = road_users(AHEAD, BEHIND, (-6.9, 0.0, SPEED_M_S, 0.0))  # the last one follows far too near
    traffic = Traffic(known, REACT)
    traffic.start(0.0)
    for step in range(1, 31):
        traffic.step(round(0.1 * step, 6), known.ego_at(0.1 * (step - 1)), SPEED_M_S)
    np.testing.assert_allclose(traffic.clocks_s, 3.0)


def test_they_react_to_one_another() -> None:
    known = road_users(BEHIND, (-22.0, 0.0, SPEED_M_S, 0.0))
    traffic = Traffic(known, REACT)
    played(traffic, 8.0, at(12.0), 0.0)
    first, second = traffic.states.boxes[:, 0]
    assert second + 4.4 < first
    assert traffic.states.speeds_m_s[1] < 1.0


def test_oncoming_traffic_brakes_for_a_car_in_its_lane() -> None:
    traffic = Traffic(road_users(ONCOMING), REACT)
    played(traffic, 6.0, at(20.0, 3.5), 0.0)
    assert traffic.states.boxes[0, 0] - 2.2 > 20.0 + EGO.length_m / 2


def test_people_do_as_recorded() -> None:
    traffic = Traffic(road_users(BEHIND, kind="person"), REACT)
    played(traffic, 3.0, at(0.0), 0.0)
    np.testing.assert_allclose(traffic.clocks_s, 3.0)


def test_a_start_forgets_the_last_episode() -> None:
    traffic = Traffic(road_users(BEHIND), REACT)
    played(traffic, 4.0, at(12.0), 0.0)
    traffic.start(0.5)
    np.testing.assert_allclose(traffic.clocks_s, 0.5)
    assert traffic.states.boxes[0, 0] == pytest.approx(-12 + 0.5 * SPEED_M_S)


def test_a_scene_without_actors_has_traffic_without_users() -> None:
    traffic = Traffic(road_users(), REACT)
    played(traffic, 0.5, at(0.0), 1.0)
    assert traffic.states.boxes.shape == (0, 5)


def test_numbers_of_no_driver_are_refused() -> None:
    with pytest.raises(InputError, match="above 0"):
        TrafficOptions(headway_s=0.0)
