"""One scenario: what planners plan, what becomes of it by what is seen, and what it meets."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.drive import CELL_M
from dreamdrive.names import QualityName
from dreamdrive.scene.street.layout import Box, track_function
from dreamdrive.tasks.plan import (
    AHEAD_RAD,
    Agents,
    Lead,
    Plan,
    avoid,
    avoid_as_uniad,
    collisions,
    constant_turn_and_acceleration,
    constant_velocity,
    follow_lane,
    instant_of,
)
from dreamdrive_bench.common.made import scene_of
from dreamdrive_bench.planning.footprints import FRONT_M, REFERENCE_BEHIND_M, rectangles_of, reference_poses
from dreamdrive_bench.planning.protocol import Protocol
from dreamdrive_bench.planning.scenario import Scenario
from streetworld import drive

PLANNERS = ("constant velocity", "lane following", "turn and acceleration")
SOURCES = ("scene", "boxes", "boxes later")
"""What stands in the way: the generated scene; true boxes that go on at their velocity; true boxes as they
really go on, which nobody knows."""
_LOOKS = 2  # between two waypoints
_PAST_S = 0.5
_BESIDE_M = 1.0
"""How far beside the middle of the lane a lead may be."""
Points = Float[np.ndarray, "_ 2"]


@dataclass(frozen=True)
class Trial:
    """What happened in a scenario.

    Attributes:
        collides: At which waypoints a plan meets a road user (T,), by the name of planner and way.
        error_m: Distance from the true drive at each waypoint (T,), by the same.
        changed: Whether the way changed the plan, by the same.
    """

    name: str
    kind: str
    collides: dict[str, list[bool]]
    error_m: dict[str, list[float]]
    changed: dict[str, bool]


def try_scenario(scenario: Scenario, protocol: Protocol, quality: QualityName, scenes: Path) -> Trial:
    """Plan, look, move and judge."""
    now = reference_poses(_track(scenario, np.array([scenario.instant_s])))[0]
    steps = round(protocol.horizon_s / protocol.step_s)
    later_s = protocol.step_s / _LOOKS * np.arange(1, _LOOKS * steps + 1)
    agents = _agents(scenario, now, protocol.step_s * np.arange(1, steps + 1))
    obstacles, speed_m_s = _obstacles(scenario, protocol, quality, scenes, now, later_s)
    truth = _seen_from(now, _at(scenario, protocol.step_s * np.arange(1, steps + 1)))
    plans = _plans(scenario, now, speed_m_s)
    for name, plan in list(plans.items()):
        for source in SOURCES:
            plans[f"{name} | ours | {source}"] = avoid(plan, speed_m_s, obstacles[source]).plan
            plans[f"{name} | uniad | {source}"] = avoid_as_uniad(plan, speed_m_s, obstacles[source]).plan
    names = list(plans)
    waypoints = np.stack([plans[name].waypoints_m for name in names])
    hits = collisions(waypoints, [agents] * len(names))
    errors = np.linalg.norm(waypoints - truth, axis=-1)
    return Trial(
        scenario.name,
        scenario.kind,
        {name: row.tolist() for name, row in zip(names, hits, strict=True)},
        {name: row.tolist() for name, row in zip(names, errors, strict=True)},
        {name: plans[name] is not plans[name.split(" | ")[0]] for name in names},
    )


def _track(scenario: Scenario, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 3"]:
    return track_function(scenario.layout.ego.track)(times_s)


def _at(scenario: Scenario, after_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 3"]:
    """True poses some time after the instant."""
    since = scenario.times_s - scenario.instant_s
    return np.stack([np.interp(after_s, since, column) for column in scenario.true_poses.T], axis=1)


def _seen_from(now: Float[np.ndarray, " 3"], points: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n 2"]:
    """Points of the map in the planning frame: x right, y ahead."""
    away, c, s = points[:, :2] - now[:2], np.cos(now[2]), np.sin(now[2])
    return np.column_stack([away @ np.array([s, -c]), away @ np.array([c, s])])


def _agents(scenario: Scenario, now: Float[np.ndarray, " 3"], after_s: Float[np.ndarray, " t"]) -> Agents:
    boxes = scenario.layout.boxes
    found = rectangles_of(boxes, scenario.instant_s + after_s)
    shape = found.shape[:2]
    found[..., :2] = _seen_from(now, found.reshape(-1, 5)).reshape(*shape, 2)
    found[..., 4] += AHEAD_RAD - now[2]
    return Agents(found, np.ones(shape, bool), tuple(box.kind for box in boxes), np.ones(len(boxes), bool))


def _plans(scenario: Scenario, now: Float[np.ndarray, " 3"], speed_m_s: float) -> dict[str, Plan]:
    past_s = scenario.instant_s - _PAST_S * np.array([2.0, 1.0, 0.0])
    poses = reference_poses(_track(scenario, past_s))
    seen = np.column_stack([_seen_from(now, poses), poses[:, 2] - now[2] + AHEAD_RAD])
    lane = _seen_from(now, scenario.lane_m)
    return {
        "constant velocity": constant_velocity(seen, past_s),
        "lane following": follow_lane(lane, speed_m_s, _lead(scenario, now, lane)),
        "turn and acceleration": constant_turn_and_acceleration(seen, past_s),
    }


def _lead(scenario: Scenario, now: Float[np.ndarray, " 3"], lane: Points) -> Lead | None:
    """The nearest road user ahead whose middle is in the lane now."""
    stations = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(lane, axis=0), axis=1))])
    own = float(stations[np.linalg.norm(lane, axis=1).argmin()])
    best: Lead | None = None
    for box in scenario.layout.boxes:
        pose, later = track_function(box.track)(scenario.instant_s + np.array([0.0, 0.1]))
        place = _seen_from(now, pose[None])[0]
        row = int(np.linalg.norm(lane - place, axis=1).argmin())
        if np.linalg.norm(lane[row] - place) > _BESIDE_M or stations[row] <= own:
            continue
        ahead = np.array([np.cos(now[2]), np.sin(now[2])])
        gap_m = float(stations[row]) - own - box.size_m[0] / 2 - FRONT_M - REFERENCE_BEHIND_M
        if best is None or gap_m < best.gap_m:
            best = Lead(gap_m, float((later[:2] - pose[:2]) @ ahead / 0.1))
    return best


def _obstacles(
    scenario: Scenario,
    protocol: Protocol,
    quality: QualityName,
    scenes: Path,
    now: Float[np.ndarray, " 3"],
    later_s: Float[np.ndarray, " t"],
) -> tuple[Mapping[str, Sequence[Points]], float]:
    """By what is seen the cells that are taken at later times, and how fast the car is."""
    scene = scene_of(
        lambda: drive(scenario.layout, protocol.frames, protocol.rate_hz, protocol.size_px),
        quality,
        scenes / scenario.name,
    )
    instant = instant_of(scene, scenario.instant_s, later_s, camera_ahead_m=REFERENCE_BEHIND_M)
    boxes = scenario.layout.boxes
    true = rectangles_of(boxes, scenario.instant_s + later_s)
    going_on = np.stack([_going_on(box, scenario.instant_s, later_s) for box in boxes], axis=1)
    return {
        "scene": instant.obstacles_m,
        "boxes": [_seen_from(now, _filled(each)) for each in going_on],
        "boxes later": [_seen_from(now, _filled(each)) for each in true],
    }, instant.speed_m_s


def _going_on(box: Box, now_s: float, later_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 5"]:
    """The rectangle of a road user that keeps its velocity of now."""
    here = rectangles_of([box], np.array([now_s - 0.1, now_s]))[:, 0]
    found = np.tile(here[1], (len(later_s), 1))
    found[:, :2] += later_s[:, None] * (here[1, :2] - here[0, :2]) / 0.1
    return found


def _filled(rectangles: Float[np.ndarray, "n 5"]) -> Points:
    """Points all over rectangles, half a cell apart and half a cell inside."""
    found: list[np.ndarray] = [np.zeros((0, 2))]
    for x, y, length, width, yaw in rectangles.tolist():
        along, aside = (
            np.linspace(-1, 1, max(2, int(np.ceil(2 * side / CELL_M)))) * max(0.0, side / 2 - CELL_M / 2)
            for side in (length, width)
        )
        flat = np.stack(np.meshgrid(along, aside), axis=-1).reshape(-1, 2)
        c, s = np.cos(yaw), np.sin(yaw)
        found.append(flat @ np.array([[c, s], [-s, c]]) + [x, y])
    return np.concatenate(found)
