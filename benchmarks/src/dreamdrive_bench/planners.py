"""Simple planners on recorded drives, judged by the exact metric and by those of ST-P3 and UniAD.

It checks formats and frames and claims nothing: a drive of some seconds ranks no planner. Without ``--log``
the drives are the log of Argoverse 2 and PandaSet 002 in the format of nuScenes, in ``DREAMDRIVE_DATA``. A
folder is that of a log of Argoverse 2, or of a data set that ``dreamdrive data list`` names; then all of its
drives count.

Planners plan at every half second at which one second of the past and three of the future are labelled. They
get the poses of the car now, half a second and one second ago. The one that follows lanes gets the lane by
the map, which goes straight on where lanes part, and who is ahead in it. The recorded drive stands beside
them: it should touch nothing, and what it touches by the exact metric is listed. Others go on as recorded,
whatever is planned: who stands still is run into from behind.

The planning frame begins where that of nuScenes' cars does: 0.76 m behind the front camera, and of a log
without cameras 0.94 m ahead of the rear axle. The car is that of nuScenes, 4.084 m x 1.85 m.

Distances are those at the horizon. Collisions of the exact metric are moments with one at any waypoint up to
the horizon; of ST-P3 shares of all waypoints up to it, of UniAD of those at it. Both excuse a plan where the
recorded drive collides by their cells; in its own row it is not excused.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from jaxtyping import Bool, Float

from dreamdrive.data.input import dataset_of
from dreamdrive.datasets.argoverse import is_argoverse, read_argoverse
from dreamdrive.errors import InputError
from dreamdrive.scene.street.log import Log
from dreamdrive.tasks.plan import (
    CAMERA_AHEAD_M,
    CAR,
    LIDAR_AHEAD_M,
    STEP_S,
    STEPS,
    STP3_METRIC,
    UNIAD_METRIC,
    Agents,
    Convention,
    Plan,
    agents_of_log,
    centre_line_of_log,
    constant_turn_and_acceleration,
    constant_velocity,
    corners,
    exact_scores,
    follow_lane,
    lead_of_log,
    overlapping,
    poses_of_log,
    raster_scores,
    road_users_of_log,
    stand_still,
    stp3_rasters,
    summarise,
    truth_of_log,
    uniad_rasters,
)
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import NONE, number, table
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.common.report import publish

_DEFAULT = (DATA / "planning/av2_adcf7d18", DATA / "nuscenes_format/pandaset_002")
_PAST_S = np.array([-1.0, -0.5, 0.0])
_AHEAD_S = STEP_S * np.arange(1, STEPS + 1)
_EDGE_S = 1e-3
_RECORDED = "recorded drive"


def main() -> int:
    """Judge all planners on all drives, print the tables."""
    parser = parser_of(__doc__, markdown=True)
    parser.add_argument("--log", type=Path, nargs="+", default=list(_DEFAULT), metavar="FOLDER")
    args = parser.parse_args()
    drives: list[dict[str, Any]] = []
    for folder in args.log:
        if not folder.is_dir():
            print(f"{folder} is not there; skipped", file=sys.stderr)
            continue
        drives += [judged(log) for log in logs_at(folder)]
    report = {"machine": describe_machine(), "claim": "none; a check of formats", "drives": drives}
    return publish(args, report, "\n".join(tables_of(drive) for drive in drives), ())


def logs_at(folder: Path) -> list[Log]:
    """The drives of a folder of any data set."""
    if is_argoverse(folder):
        return [read_argoverse(folder)]
    logs = dataset_of(None, folder).logs
    if logs is None:
        raise InputError(f"{folder} is no drive of a data set; expected one with labels")
    return [logs.read(folder, name) for name in logs.names(folder)]


def origin_ahead_m(log: Log) -> float:
    """How far the origin of the planning frame is ahead of that of the ego frame, see above."""
    return float(log.cameras[0].ego_from_camera[0, 3]) - CAMERA_AHEAD_M if log.cameras else LIDAR_AHEAD_M


def moments_of(log: Log) -> list[float]:
    """Every half second with enough past and future."""
    first_s, last_s = float(log.times_s[0] - _PAST_S[0]), float(log.times_s[-1]) - STEPS * STEP_S
    return (first_s + STEP_S * np.arange(int((last_s - first_s + _EDGE_S) / STEP_S) + 1)).tolist()


def judged(log: Log) -> dict[str, Any]:
    """The figures of a drive by planner, and what the recorded drive itself touches."""
    ahead_m, moments = origin_ahead_m(log), moments_of(log)
    agents = [agents_of_log(log, now_s, _AHEAD_S, ahead_m) for now_s in moments]
    truth_m = np.stack([truth_of_log(log, now_s, origin_ahead_m=ahead_m).waypoints_m for now_s in moments])
    rows = [_row(_RECORDED, truth_m, truth_m, agents, ahead_m)]
    for name, planner in PLANNERS.items():
        plans = [planner(log, now_s, ahead_m) for now_s in moments]
        rows.append({"planner": name})
        if all(plan is not None for plan in plans):
            waypoints_m = np.stack([plan.waypoints_m for plan in plans if plan is not None])
            rows[-1] = _row(name, waypoints_m, truth_m, agents, ahead_m)
    way_m = np.linalg.norm(np.diff(log.world_from_ego[:, :2, 3], axis=0), axis=1).sum()
    return {
        "name": log.name,
        "moments": len(moments),
        "way_m": float(way_m),
        "origin_ahead_m": ahead_m,
        "road_users": len(road_users_of_log(log)),
        "rows": rows,
        "recorded_drive_from_boxes_m": _nearest_m(truth_m, agents),
        "touched_by_recorded_drive": _touched(log, moments, truth_m, agents),
    }


def _velocity(log: Log, now_s: float, ahead_m: float) -> Plan:
    return constant_velocity(poses_of_log(log, now_s, _PAST_S, ahead_m), _PAST_S)


def _turn(log: Log, now_s: float, ahead_m: float) -> Plan:
    return constant_turn_and_acceleration(poses_of_log(log, now_s, _PAST_S, ahead_m), _PAST_S)


def _lane(log: Log, now_s: float, ahead_m: float) -> Plan | None:
    line = centre_line_of_log(log, now_s, ahead_m)
    if line is None:
        return None
    before, now = poses_of_log(log, now_s, _PAST_S[1:], ahead_m)
    speed_m_s = max(float(now[1] - before[1]), 0.0) / STEP_S
    return follow_lane(line, speed_m_s, lead_of_log(log, now_s, line, ahead_m))


PLANNERS: dict[str, Callable[[Log, float, float], Plan | None]] = {
    "stand still": lambda log, now_s, ahead_m: stand_still(),
    "constant velocity": _velocity,
    "constant turn and acceleration": _turn,
    "follow lane": _lane,
}
"""A plan of a log, a moment, and how far ahead the origin is; None where the map has no lane."""


def _row(
    name: str,
    plans_m: Float[np.ndarray, "n t 2"],
    truth_m: Float[np.ndarray, "n t 2"],
    agents: list[Agents],
    ahead_m: float,
) -> dict[str, Any]:
    known = np.ones(plans_m.shape[:2], bool)
    exact = summarise(exact_scores(plans_m, truth_m, known, agents), "any")
    stp3, uniad = (replace(each, excuse_truth=name != _RECORDED) for each in (STP3_METRIC, UNIAD_METRIC))
    of_stp3 = np.stack([stp3_rasters(each, origin_ahead_m=ahead_m) for each in agents])
    of_uniad = np.stack([uniad_rasters(each, known[0]) for each in agents])
    return {
        "planner": name,
        "horizons_s": [each.horizon_s for each in exact.horizons],
        "distance_m": [each.distance_m for each in exact.horizons],
        "exact_collisions": [each.collisions for each in exact.horizons],
        "stp3_collisions": _by_rasters(plans_m, truth_m, of_stp3, stp3),
        "uniad_collisions": _by_rasters(plans_m, truth_m, of_uniad, uniad),
    }


def _by_rasters(
    plans_m: Float[np.ndarray, "n t 2"],
    truth_m: Float[np.ndarray, "n t 2"],
    rasters: np.ndarray,
    convention: Convention,
) -> list[list[int]]:
    """Collisions of the car's box, and the cases they are among, by horizon."""
    known: Bool[np.ndarray, "n t"] = np.ones(plans_m.shape[:2], bool)
    scores = raster_scores(plans_m, truth_m, known, rasters, convention)
    return [[each.collisions, each.cases] for each in summarise(scores, convention.reading).horizons]


def _nearest_m(truth_m: Float[np.ndarray, "n t 2"], agents: list[Agents]) -> float | None:
    """Least distance of the recorded car from a box at any waypoint; None where there is no box."""
    found = [
        shapely.distance(shapely.Polygon(corners(car)), shapely.polygons(corners(boxes[there]))).min()
        for way_m, around in zip(truth_m, agents, strict=True)
        for car, boxes, there in zip(CAR.along(way_m), around.boxes, around.there, strict=True)
        if there.any()
    ]
    return float(min(found)) if found else None


def _touched(
    log: Log, moments: list[float], truth_m: Float[np.ndarray, "n t 2"], agents: list[Agents]
) -> list[dict[str, Any]]:
    """Boxes that the recorded drive overlaps by the exact metric, and when on the clock of the log."""
    road_users = road_users_of_log(log)
    when: dict[int, set[float]] = {}
    for now_s, way_m, around in zip(moments, truth_m, agents, strict=True):
        hits = overlapping(CAR.along(way_m)[:, None], around.boxes) & around.there
        for step, user in np.argwhere(hits).tolist():
            when.setdefault(user, set()).add(round(now_s + float(_AHEAD_S[step]), 2))
    return [
        {"id": road_users[user].id, "category": road_users[user].category, "times_s": sorted(times)}
        for user, times in sorted(when.items())
    ]


def tables_of(drive: dict[str, Any]) -> str:
    """The table of a drive, and what stands below it."""
    head = ["planner", "L2 at 1 / 2 / 3 s (m)", "exact, moments", "ST-P3 (%)", "UniAD (%)"]
    lines = [[row["planner"], *(_cells(row) if "distance_m" in row else [NONE] * 4)] for row in drive["rows"]]
    away_m = number(drive["recorded_drive_from_boxes_m"])
    text = f"{drive['name']}: {drive['moments']} moments, {drive['way_m']:.0f} m, never nearer to a box than "
    text += f"{away_m} m\n\n{table(head, lines)}\n"
    for each in drive["touched_by_recorded_drive"]:
        text += f"\nthe recorded drive touches {each['category']} {each['id']} at {each['times_s']} s\n"
    return text


def _cells(row: dict[str, Any]) -> list[str]:
    rates = [
        " / ".join(f"{100 * hits / cases:.1f}" for hits, cases in row[name])
        for name in ("stp3_collisions", "uniad_collisions")
    ]
    return [
        " / ".join(f"{value:.2f}" for value in row["distance_m"]),
        " / ".join(map(str, row["exact_collisions"])),
        *rates,
    ]
