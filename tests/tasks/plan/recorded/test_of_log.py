"""Moments of recorded drives: frames, uneven times, who is seen, the lane and who is ahead in it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.datasets.argoverse import read_argoverse
from dreamdrive.datasets.nuscenes import NUSCENES
from dreamdrive.errors import InputError
from dreamdrive.scene.street.log import LANE_CENTRE, BoxTrack, Log, LogMap
from dreamdrive.tasks.plan import (
    AHEAD_RAD,
    Lead,
    agents_of_log,
    centre_line_of_log,
    collisions,
    constant_turn_and_acceleration,
    constant_velocity,
    follow_lane,
    lead_of_log,
    poses_of_log,
    road_users_of_log,
    truth_of_log,
)

UNEVEN_S = np.array([0.0, 0.4, 1.0, 1.1, 2.3, 3.0, 4.7, 6.0])
PAST_S = np.array([-1.0, -0.5, 0.0])
AHEAD_S = 0.5 * np.arange(1, 7)
NOW = np.zeros(1)
FRONT_M = 0.5 + 4.084 / 2
"""Front of the car ahead of the origin of the planning frame."""


def pose(x: float, y: float, yaw: float = 0.0, z: float = 0.0, pitch: float = 0.0) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3] = Rotation.from_euler("ZY", [yaw, pitch]).as_matrix()
    made[:3, 3] = x, y, z
    return made


def box(
    poses: list[np.ndarray],
    times_s: np.ndarray = UNEVEN_S,
    category: str = "vehicle.car",
    visibility: int | list[int] = 0,
) -> BoxTrack:
    count = len(times_s)
    return BoxTrack(
        id=category,
        category=category,
        times_s=times_s,
        world_from_box=np.stack(poses * count if len(poses) == 1 else poses),
        size_lwh_m=np.column_stack([4.0 + times_s, np.full(count, 2.0), np.full(count, 1.5)]),
        visibility=np.broadcast_to(np.array(visibility), count).copy(),
        moves=np.full(count, -1),
        lidar_points=np.full(count, -1),
        attributes=((),) * count,
    )


def drive(
    *boxes: BoxTrack,
    ego: list[np.ndarray] | None = None,
    lanes: tuple[np.ndarray, ...] = (),
    moved: np.ndarray | None = None,
) -> Log:
    """A drive of six seconds at 5 m/s along x of the world, which may be ``moved`` as a whole."""
    frame = np.eye(4) if moved is None else moved
    path = [pose(5 * t_s, 0) for t_s in UNEVEN_S] if ego is None else ego
    lines = tuple(line @ frame[:2, :2].T + frame[:2, 3] for line in lanes)
    return Log(
        name="drive",
        about="",
        location="",
        root=Path(),
        cameras=(),
        times_s=UNEVEN_S,
        start_us=0,
        world_from_ego=frame @ np.stack(path),
        boxes=tuple(replace(each, world_from_box=frame @ each.world_from_box) for each in boxes),
        map=LogMap(lines={LANE_CENTRE: lines}),
    )


def test_a_box_ten_metres_ahead_is_ten_metres_less_the_lidar_ahead() -> None:
    log = drive(box([pose(10, 0)]), box([pose(0, -3, -np.pi / 2)]))
    found = agents_of_log(log, 0.0, NOW)
    np.testing.assert_allclose(found.boxes[0, 0], [0, 10 - 0.94, 4, 2, AHEAD_RAD], atol=1e-12)
    # To the right is x; what points right has the yaw 0.
    np.testing.assert_allclose(found.boxes[0, 1], [3, -0.94, 4, 2, 0], atol=1e-12)
    assert agents_of_log(log, 0.0, NOW, origin_ahead_m=0.0).boxes[0, 0, 1] == pytest.approx(10)


@settings(max_examples=30)
@given(
    st.floats(-np.pi, np.pi),
    st.floats(-1000, 1000),
    st.floats(-1000, 1000),
    st.floats(0, 3),
    st.integers(0, 99),
)
def test_all_is_the_same_wherever_the_world_lies(
    yaw: float, x: float, y: float, now_s: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    moved = pose(x, y, yaw, 30.0)

    def made(frame: np.ndarray | None) -> Log:
        path = [pose(6 * t_s, 0.1 * t_s**2, 0.05 * t_s, 0.2 * t_s, -0.03) for t_s in UNEVEN_S]
        others = [box([pose(x_m, y_m, turn)]) for x_m, y_m, turn in places.tolist()]
        return drive(*others, ego=path, lanes=(np.array([[-5.0, 0.3], [20, 0.5], [60, 9]]),), moved=frame)

    places = rng.uniform(-20, 20, (3, 3))
    one, other = made(None), made(moved)
    for log in (one, other):
        assert len(road_users_of_log(log)) == 3
    found, same = (agents_of_log(log, now_s, AHEAD_S) for log in (one, other))
    np.testing.assert_allclose(found.boxes[..., :4], same.boxes[..., :4], atol=1e-8)
    np.testing.assert_allclose(np.cos(found.boxes[..., 4] - same.boxes[..., 4]), 1, atol=1e-12)
    truth, again = (truth_of_log(log, now_s).waypoints_m for log in (one, other))
    np.testing.assert_allclose(truth, again, atol=1e-8)
    line, other_line = (centre_line_of_log(log, now_s) for log in (one, other))
    assert line is not None
    assert other_line is not None
    np.testing.assert_allclose(line, other_line, atol=1e-8)


def test_a_turned_and_tilted_car_sees_boxes_in_its_own_frame() -> None:
    ego = pose(100, 50, 2.0, 8.0, -0.1)
    ahead = ego @ pose(12, 2, 0.3)
    found = agents_of_log(drive(box([ahead]), ego=[ego] * len(UNEVEN_S)), 2.0, NOW)
    np.testing.assert_allclose(found.boxes[0, 0, [0, 1, 4]], [-2, 11.06, AHEAD_RAD + 0.3], atol=1e-9)


def test_at_uneven_times_a_steady_drive_is_steady() -> None:
    log = drive(box([pose(20 - 2 * t_s, 4) for t_s in UNEVEN_S]))
    np.testing.assert_allclose(
        truth_of_log(log, 1.7).waypoints_m, np.column_stack([np.zeros(6), 5 * AHEAD_S]), atol=1e-9
    )
    past = poses_of_log(log, 1.7, PAST_S)
    np.testing.assert_allclose(past, [[0, -5, AHEAD_RAD], [0, -2.5, AHEAD_RAD], [0, 0, AHEAD_RAD]], atol=1e-9)
    found = agents_of_log(log, 1.7, AHEAD_S)
    np.testing.assert_allclose(found.boxes[:, 0, 1], 20 - 2 * (1.7 + AHEAD_S) - 5 * 1.7 - 0.94, atol=1e-9)
    # Sizes are those of the nearest label.
    np.testing.assert_allclose(found.boxes[:, 0, 2], 4 + np.array([2.3, 3.0, 3.0, 3.0, 4.7, 4.7]))
    for planner in (constant_velocity, constant_turn_and_acceleration):
        np.testing.assert_allclose(
            planner(past, PAST_S).waypoints_m, truth_of_log(log, 1.7).waypoints_m, atol=1e-9
        )


def test_a_turn_leads_to_the_side() -> None:
    """A quarter of a circle of 30 m to the left, 10 m/s: the lidar is ahead of the axle that drives it."""
    angles = UNEVEN_S / 3
    log = drive(ego=[pose(30 * np.sin(a), 30 - 30 * np.cos(a), a) for a in angles])
    found = poses_of_log(log, 0.0, np.array([3.0]))[0]
    lidar = np.array([30 * np.sin(1) + 0.94 * np.cos(1), 30 - 30 * np.cos(1) + 0.94 * np.sin(1)])
    np.testing.assert_allclose(found, [-lidar[1], lidar[0] - 0.94, AHEAD_RAD + 1], atol=1e-9)


def test_nobody_is_there_before_and_after_the_labels() -> None:
    found = agents_of_log(drive(box([pose(10, 0)], np.array([1.0, 2.0]))), 0.0, AHEAD_S)
    assert found.there[:, 0].tolist() == [False, True, True, True, False, False]


def test_cones_and_animals_are_no_road_users() -> None:
    kinds = (
        "movable_object.trafficcone",
        "human.pedestrian.adult",
        "animal",
        "vehicle.bus.rigid",
        "static.manmade",
    )
    log = drive(*(box([pose(10, 0)], category=kind) for kind in kinds))
    assert agents_of_log(log, 0.0, NOW).categories == ("human.pedestrian.adult", "vehicle.bus.rigid")
    assert [each.category for each in road_users_of_log(log)] == [kinds[1], kinds[3]]


def test_who_was_seen_by_now_is_seen() -> None:
    later = np.array([3.0, 4.7])
    log = drive(
        box([pose(10, 0)], visibility=[1, 1, 2, 1, 1, 1, 1, 1]),
        box([pose(10, 0)], visibility=1),
        box([pose(10, 0)], visibility=0),
        box([pose(10, 0)], later, visibility=4),
    )
    for now_s, seen in ((0.9, [False] * 4), (1.0, [True] + [False] * 3), (3.0, [True, False, False, True])):
        assert agents_of_log(log, now_s, NOW).seen.tolist() == seen


def test_where_nothing_tells_of_visibility_all_are_seen() -> None:
    log = drive(box([pose(10, 0)]), box([pose(10, 0)], np.array([3.0, 4.7])))
    assert agents_of_log(log, 0.0, NOW).seen.all()


@pytest.mark.parametrize("now_s", [-0.1, 3.1, 6.2, float("nan")])
def test_times_without_labels_are_refused(now_s: float) -> None:
    log = drive(box([pose(10, 0)]))
    with pytest.raises(InputError, match="drive is labelled from 0 to 6 s"):
        truth_of_log(log, now_s)
    with pytest.raises(InputError, match="drive is labelled from 0 to 6 s"):
        agents_of_log(log, now_s, AHEAD_S)
    assert len(truth_of_log(log, 3.0)) == 6


def straight(start: float, end: float, y: float = 0.0) -> np.ndarray:
    return np.column_stack([np.linspace(start, end, 11), np.full(11, y)])


def test_the_lane_goes_on_straight_where_lanes_part() -> None:
    angles = np.linspace(0, 1.4, 15)
    left = np.column_stack([40 + 12 * np.sin(angles), 0.4 + 12 - 12 * np.cos(angles)])
    oncoming = straight(0, 40, 0.2)[::-1]
    lanes = (
        left,
        oncoming,
        straight(0, 40, 0.4),
        straight(40, 70, 0.4),
        straight(70, 300, 0.4),
        straight(0, 40, 3.9),
    )
    line = centre_line_of_log(drive(lanes=lanes), 2.0)
    assert line is not None
    np.testing.assert_allclose(line[:, 0], -0.4, atol=1e-9)
    np.testing.assert_allclose(line[[0, -1], 1], [-10.94, 300 - 10.94])
    assert (np.diff(line[:, 1]) >= 0).all()
    # In the junction both lanes begin where the car is.
    line = centre_line_of_log(drive(lanes=lanes), 6.0)
    assert line is not None
    assert line[-1, 1] == pytest.approx(300 - 30.94)


def test_a_lane_that_turns_is_followed() -> None:
    angles = np.linspace(0, 1.4, 15)
    turn = np.column_stack([40 + 12 * np.sin(angles), 12 - 12 * np.cos(angles)])
    line = centre_line_of_log(drive(lanes=(straight(0, 40), turn)), 5.0)
    assert line is not None
    np.testing.assert_allclose(line[-1], [-turn[-1, 1], turn[-1, 0] - 25.94], atol=1e-9)
    plan = follow_lane(line, 5.0)
    assert plan.waypoints_m[-1, 0] < -0.5


def test_without_a_lane_there_is_no_line() -> None:
    for lanes in ((), (straight(0, 40, 3.5),), (straight(0, 40)[::-1],), (np.array([[0.0, -20], [1, 20]]),)):
        assert centre_line_of_log(drive(lanes=lanes), 0.0) is None


def lead(*boxes: BoxTrack, now_s: float = 2.0) -> Lead | None:
    log = drive(*boxes, lanes=(straight(-20, 100),))
    line = centre_line_of_log(log, now_s)
    assert line is not None
    return lead_of_log(log, now_s, line)


def test_the_first_road_user_in_the_lane_is_ahead() -> None:
    """At 2 s the origin is at 10.94 m. The box there has 2.3 m more of length than at first."""
    goes = box([pose(30 + 3 * t_s, 0.2) for t_s in UNEVEN_S])
    beyond = box([pose(60, 0)], category="vehicle.truck")
    beside = box([pose(20, 3.5)])
    behind = box([pose(5, 0)])
    cone = box([pose(15, 0)], category="movable_object.trafficcone")
    found = lead(beyond, goes, beside, behind, cone)
    assert found is not None
    assert found.gap_m == pytest.approx(36 - 6.3 / 2 - 10.94 - FRONT_M)
    assert found.speed_m_s == pytest.approx(3)
    assert lead(beside, behind, cone) is None


def test_who_cuts_across_and_was_not_labelled_before_stands() -> None:
    across = box([pose(25, 2.4, np.pi / 2)], np.array([1.9, 2.3]), "human.pedestrian.adult")
    found = lead(across)
    assert found is not None
    assert found.gap_m == pytest.approx(25 - 1 - 10.94 - FRONT_M)
    assert found.speed_m_s == 0


def test_the_car_brakes_for_who_stands_ahead() -> None:
    """It stops by itself where the recorded one, which drives on, would hit."""
    log = drive(box([pose(24, 0)]), lanes=(straight(-20, 100),))
    line = centre_line_of_log(log, 2.0)
    assert line is not None
    plan = follow_lane(line, 5.0, lead_of_log(log, 2.0, line))
    around = agents_of_log(log, 2.0, AHEAD_S)
    assert not collisions(plan.waypoints_m[None], [around]).any()
    assert collisions(truth_of_log(log, 2.0).waypoints_m[None], [around]).any()


@pytest.mark.parametrize("name", ["planning/av2_adcf7d18", "nuscenes_format/pandaset_002"])
def test_recorded_drives_hit_nobody(data_dir: Path, name: str) -> None:
    """Frames of car, boxes and time fit together; a mistake of 1 m or half a second would show."""
    folder = data_dir / name
    if not folder.is_dir():
        pytest.skip(f"DREAMDRIVE_DATA ({data_dir}) lacks {name}")
    assert NUSCENES.logs is not None
    log = read_argoverse(folder) if "av2" in name else NUSCENES.logs.read(folder, "scene-0002")
    around_m = []
    for now_s in np.arange(0.0, float(log.times_s[-1]) - 3.0, 0.5).tolist():
        agents = agents_of_log(log, now_s, AHEAD_S)
        assert not collisions(truth_of_log(log, now_s).waypoints_m[None], [agents]).any()
        around_m.append(np.linalg.norm(agents.boxes[agents.there][:, :2], axis=1).min())
    assert min(around_m) < 8
