"""Scenarios of the planning experiment: nobody collides, and who goes straight on does."""

from functools import cache

import msgspec
import numpy as np
import pytest
import shapely
from jaxtyping import Bool, Float

from dreamdrive.scene.street.layout import Box, track_function
from dreamdrive.tasks.plan import (
    AHEAD_RAD,
    CAR,
    Agents,
    IdmOptions,
    Lead,
    Plan,
    collisions,
    constant_velocity,
    follow_lane,
    overlapping,
    planning_from_ego,
)
from dreamdrive_bench.planning.driver import STEP_S, Driver, covered
from dreamdrive_bench.planning.ego import EgoWay
from dreamdrive_bench.planning.footprints import (
    FRONT_M,
    ego_rectangles,
    in_the_way,
    meetings,
    rectangles_of,
    reference_poses,
)
from dreamdrive_bench.planning.picture import draw_grid
from dreamdrive_bench.planning.protocol import KINDS, Kind, read_protocol
from dreamdrive_bench.planning.scenario import Scenario
from dreamdrive_bench.planning.scenarios import draw_scenario
from dreamdrive_bench.planning.streets import street_of
from streetworld import StreetOptions, draw_street, drive
from streetworld.edition1.traffic import to_track
from streetworld.engine.road import LANE_M

PROTOCOL = read_protocol()
SEEDS = {group.kind: group.seeds[1] for group in PROTOCOL.development}


@cache
def drawn(kind: Kind) -> Scenario:
    return draw_scenario(kind, SEEDS[kind])


def test_the_protocol_keeps_development_and_test_apart() -> None:
    assert tuple(group.kind for group in PROTOCOL.test) == KINDS
    for groups, first, last in ((PROTOCOL.development, 59000, 59999), (PROTOCOL.test, 60000, 60999)):
        seeds = [seed for group in groups for seed in group.seeds]
        assert len(set(seeds)) == len(seeds)
        assert first <= min(seeds) <= max(seeds) <= last
    counts = {group.kind: group.count for group in PROTOCOL.test}
    assert sum(counts.values()) == 200
    assert counts["clear"] >= 0.2 * 200
    assert PROTOCOL.frame_times_s[-1] == PROTOCOL.instant_s == pytest.approx(2.3)
    assert PROTOCOL.end_s == pytest.approx(6.3)


def test_equal_seeds_give_equal_scenarios() -> None:
    again, other = draw_scenario("cut_in", SEEDS["cut_in"]), draw_scenario("cut_in", SEEDS["cut_in"] + 1)
    encoded = [msgspec.json.encode(each.layout) for each in (drawn("cut_in"), again, other)]
    assert encoded[0] == encoded[1] != encoded[2]


@pytest.mark.parametrize("kind", KINDS)
def test_nobody_collides_and_the_ego_drives_comfortably(kind: Kind) -> None:
    check(drawn(kind))


def check(scenario: Scenario) -> None:
    """All that is true of every scenario."""
    layout, times = scenario.layout, np.arange(round(PROTOCOL.end_s / STEP_S) + 1) * STEP_S
    boxes = rectangles_of(layout.boxes, times)
    both = overlapping(boxes[:, :, None], boxes[:, None])
    assert not (both & ~np.eye(len(layout.boxes), dtype=bool)).any(), scenario.name
    houses = shapely.union_all([shapely.Polygon(house.polygon) for house in layout.buildings])
    assert not in_the_way(layout.boxes, houses, times).any(), scenario.name
    poses = reference_poses(track_function(layout.ego.track)(times))
    assert not meetings(ego_rectangles(poses), layout.boxes, times).any(), scenario.name
    now = round(scenario.instant_s / STEP_S)
    np.testing.assert_allclose(poses[now:], scenario.true_poses, atol=1e-9)
    speeds = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1) / STEP_S
    assert np.ptp(speeds[:now]) < 0.1 * speeds[:now].mean() + 0.2, scenario.name
    change = np.diff(poses[:, :2], n=2, axis=0) / STEP_S**2
    cos, sin = np.cos(poses[1:-1, 2]), np.sin(poses[1:-1, 2])
    assert (cos * change[:, 0] + sin * change[:, 1]).min() >= -4, scenario.name
    assert np.abs(cos * change[:, 1] - sin * change[:, 0]).max() <= 3, scenario.name
    assert np.linalg.norm(scenario.lane_m - poses[now, :2], axis=1).min() < 0.6, scenario.name
    assert bool(scenario.actors) == (scenario.kind != "clear")


@pytest.mark.parametrize("kind", KINDS)
def test_going_straight_on_is_what_the_kind_says(kind: Kind) -> None:
    straight_on = plans_collide(drawn(kind))[0]
    assert straight_on == (kind != "clear")


def test_actors_do_what_their_kind_says() -> None:
    def motion(kind: Kind) -> tuple[Float[np.ndarray, "t 3"], Float[np.ndarray, " t"], Scenario]:
        scenario = drawn(kind)
        box = next(box for box in scenario.layout.boxes if box.id == scenario.actors[0])
        poses = track_function(box.track)(np.arange(0, PROTOCOL.end_s, STEP_S))
        return poses, np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1) / STEP_S, scenario

    now = round(PROTOCOL.instant_s / STEP_S)
    for kind in ("stopped", "parked"):
        assert motion(kind)[1].max() == 0
    for kind in ("crossing", "walking"):
        speeds = motion(kind)[1]
        assert np.ptp(speeds) < 0.1
        assert speeds.mean() > 0.8
    speeds = motion("slowing")[1]
    assert speeds[0] > speeds[now] + 0.5 > speeds[-1] + 1
    poses, _, scenario = motion("cut_in")
    away = [np.linalg.norm(scenario.lane_m - pose[:2], axis=1).min() for pose in (poses[now], poses[-1])]
    assert LANE_M / 2 < away[0] < LANE_M
    assert away[1] < 0.6 * away[0]


def test_roads_are_those_of_the_lines() -> None:
    for seed in (1, 2, 3, 5):
        layout = draw_street(seed, StreetOptions(6.3, edition=1))
        street = street_of(layout)
        assert (street.other is not None) == (seed % 3 == 2)
        stations = np.arange(-40.0, 120.0)
        roads = [street.main] if street.other is None else [street.main, street.other]
        for road in roads:
            for side in (-1, 1):
                edge = road.at(
                    stations[(stations > road.start_m) & (stations < road.end_m)], side * road.lanes * LANE_M
                )
                lines = shapely.union_all(
                    [shapely.LineString(line.points) for line in layout.lines if line.kind == "road_edge"]
                )
                away = shapely.distance(shapely.points(edge[:, :2]), lines)
                assert np.quantile(away, 0.7) < 0.03  # lines end before a junction


def test_the_driver_stops_behind_whom_it_meets_and_keeps_its_speed_otherwise() -> None:
    street = street_of(draw_street(3, StreetOptions(6.3, edition=1)))
    way = EgoWay(street.main, street.lane_left_m, 0.0, 9.0, 0.0, 2.3, 0.0)
    times = 2.3 + STEP_S * np.arange(60)

    def stations(ahead_m: float, left_m: float) -> Float[np.ndarray, " t"]:
        station = np.array([way.now_m + FRONT_M + ahead_m + 2])
        track = to_track(np.zeros(1), street.main.at(station, street.lane_left_m + left_m))
        box = Box(id="standing", kind="car", size_m=(4.0, 1.8, 1.5), track=track)
        return Driver().drive(way, covered(way, [box], times))

    stopped = stations(24.0, 0.0)
    assert 0.5 < way.now_m + 24 - stopped[-1] < 6
    assert np.diff(stopped, n=2).min() / STEP_S**2 >= -4
    np.testing.assert_allclose(stations(24.0, 2.6), way.now_m + 9 * (times - 2.3), atol=1e-6)


def test_the_picture_shows_where_the_ego_comes_to() -> None:
    shown = [drawn(kind) for kind in ("stopped", "clear", "walking")]
    picture = draw_grid(shown, PROTOCOL.horizon_s, columns=2)
    height, width = picture.shape[0] // 2, picture.shape[1] // 2
    brown = (np.abs(picture.astype(int) - (190, 90, 10)) < 6).all(axis=-1)
    assert brown[:height, :width].any()
    assert not brown[:height, width:].any()
    assert brown[height:, :width].any()
    assert (picture[height:, width:] == 255).all()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["stopped", "crossing", "walking", "cut_in"])
def test_the_actor_is_seen(kind: Kind) -> None:
    scenario = drawn(kind)
    made = drive(scenario.layout, PROTOCOL.frames, PROTOCOL.rate_hz, PROTOCOL.size_px, antialiased=False)
    instance = next(box.instance for box in made.boxes if box.id == scenario.actors[0])
    pixels = (made.instance == instance).sum(axis=(1, 2))
    assert (pixels >= 60).sum() >= 6
    assert pixels[-1] >= 60


@pytest.mark.slow
def test_planners_that_others_should_beat_collide_often_enough() -> None:
    """Every fourth scenario of the protocol: of all 200, 40 collisions of each planner are wanted."""
    hits: list[Bool[np.ndarray, " p"]] = []
    for group in PROTOCOL.test:
        for seed in group.seeds[::4]:
            scenario = draw_scenario(group.kind, seed)
            check(scenario)
            hits.append(plans_collide(scenario))
            assert group.kind != "clear" or not hits[-1].any(), scenario.name
    straight_on, in_lane = np.mean(hits, axis=0)
    assert straight_on >= 0.2
    assert in_lane >= 0.2


def plans_collide(scenario: Scenario) -> Bool[np.ndarray, "2"]:
    """Whether constant velocity collides within the horizon, and whether following the lane does."""
    steps = round(PROTOCOL.horizon_s / STEP_S)
    times = scenario.instant_s + STEP_S * np.arange(1, steps + 1)
    boxes = rectangles_of(scenario.layout.boxes, times)
    here = scenario.true_poses[0]
    boxes[..., :2], boxes[..., 4] = _local(boxes[..., :2], here), boxes[..., 4] - here[2] + AHEAD_RAD
    count = boxes.shape[1]
    around = Agents(boxes, np.ones((steps, count), bool), ("vehicle.car",) * count, np.ones(count, bool))
    plans = _plans(scenario, steps)
    return np.any(collisions(np.stack([plan.waypoints_m for plan in plans]), [around, around]), axis=1)


def _plans(scenario: Scenario, steps: int) -> tuple[Plan, Plan]:
    here = scenario.true_poses[0]
    seen = scenario.instant_s + np.array([-STEP_S, 0.0])
    poses = reference_poses(track_function(scenario.layout.ego.track)(seen))
    past = np.column_stack([_local(poses[:, :2], here), poses[:, 2] - here[2] + AHEAD_RAD])
    speed = float(np.linalg.norm(poses[1, :2] - poses[0, :2]) / STEP_S)
    line, options = _local(scenario.lane_m, here), IdmOptions(desired_m_s=speed)
    in_lane = follow_lane(line, speed, _lead(scenario, seen), options, steps, STEP_S)
    return constant_velocity(past, seen, steps, STEP_S), in_lane


def _lead(scenario: Scenario, seen_s: Float[np.ndarray, "2"]) -> Lead | None:
    """Who drives or stands ahead in the ego's lane at the instant."""
    line, boxes = scenario.lane_m, rectangles_of(scenario.layout.boxes, seen_s)
    here = np.linalg.norm(line - scenario.true_poses[0, :2], axis=1).argmin()
    leads: list[Lead] = []
    for before, now in zip(boxes[0], boxes[1], strict=True):
        away = np.linalg.norm(line - now[:2], axis=1)
        near = away.argmin()
        if away[near] > LANE_M / 2 or not here < near < len(line) - 1:
            continue
        speed = (now[:2] - before[:2]) @ (line[near + 1] - line[near - 1]) / 2 / STEP_S
        gap = near - here - now[2] / 2 - CAR.length_m / 2 - CAR.ahead_m
        leads.append(Lead(max(float(gap), 0.01), max(float(speed), 0.0)))
    return min(leads, key=lambda lead: lead.gap_m, default=None)


def _local(points: Float[np.ndarray, "*b 2"], pose: Float[np.ndarray, "3"]) -> Float[np.ndarray, "*b 2"]:
    """Points of the map in the planning frame, whose origin is the ego's reference point."""
    away, cos, sin = points - pose[:2], np.cos(pose[2]), np.sin(pose[2])
    ahead, left = cos * away[..., 0] + sin * away[..., 1], cos * away[..., 1] - sin * away[..., 0]
    return planning_from_ego(np.stack([ahead, left], axis=-1), 0.0)
