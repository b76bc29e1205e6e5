"""The lane of a recorded car, and who is ahead in it, as ``follow_lane`` takes them."""

import math

import numpy as np
import shapely
from jaxtyping import Float

from dreamdrive.scene.street.log import LANE_CENTRE, Log
from dreamdrive.tasks.plan.footprint import CAR, Footprint
from dreamdrive.tasks.plan.lane_following import Lead
from dreamdrive.tasks.plan.recorded.of_log import agents_of_log, drive_of_log
from dreamdrive.tasks.plan.rectangles import corners
from dreamdrive.tasks.plan.trajectory import LIDAR_AHEAD_M, planning_from_ego

_REACH_M = 100.0
"""As far as a lane is followed: more than three seconds at any speed in towns."""
_NEAR_M = 3.0
"""The own lane is no farther beside the car."""
_ALIKE_M = 0.5
"""Lanes that are as near as this to one another begin at one place, and part later."""
_ALONG_RAD = np.pi / 3
"""Lanes that point farther to the side cross the way, or are of oncoming traffic."""
_JOIN_M = 0.1
"""A lane goes on in one that begins so near to its end."""
_ASIDE_M = 0.3
"""What leaves less room than this beside the car is ahead of it."""
_SPEED_S = 0.5
"""Speeds are those over this time."""

Line = Float[np.ndarray, "_ 2"]
_AHEAD = np.array([[0.0, 0.0], [0.0, 1.0]])


def centre_line_of_log(
    log: Log, now_s: float, origin_ahead_m: float = LIDAR_AHEAD_M
) -> Float[np.ndarray, "n 2"] | None:
    """The middle of the lane that the car is in, in the planning frame of now, and on for some 100 m.

    Where lanes part it goes on as straight as it can: nobody says where the drive is to lead, and the
    recorded way is what plans are compared with.

    Args:
        log: The drive.
        now_s: The moment, on the clock of the log.
        origin_ahead_m: How far the origin of the planning frame is ahead of that of the ego frame.

    Returns:
        A polyline (N, 2) in the direction of travel; None where the map has no lanes, or none here.

    Raises:
        InputError: The moment lies outside the labelled times.
    """
    ego_from_world = np.linalg.inv(drive_of_log(log, now_s, np.zeros(0)).at(np.array([now_s]))[0])
    lines = [
        _seen_from(ego_from_world, each, origin_ahead_m)
        for each in log.map.lines.get(LANE_CENTRE, ())
        if len(each) > 1
    ]
    way = _own(lines)
    if way is None:
        return None
    taken = [way]
    while sum(map(_length_m, taken)) < _REACH_M:
        following = _following(taken[-1], [each for each in lines if not any(each is one for one in taken)])
        if following is None:
            break
        taken.append(following)
    return np.concatenate(taken)


def lead_of_log(
    log: Log,
    now_s: float,
    centre_line: Float[np.ndarray, "n 2"],
    origin_ahead_m: float = LIDAR_AHEAD_M,
    footprint: Footprint = CAR,
) -> Lead | None:
    """The first road user ahead on a centre line that leaves the car no room to pass.

    Its speed is that over the last half second; 0 where it was not labelled before.

    Args:
        log: The drive.
        now_s: The moment, on the clock of the log, half a second after its first label or later.
        centre_line: Polyline (N, 2) in the planning frame of now.
        origin_ahead_m: How far the origin of the planning frame is ahead of that of the ego frame.
        footprint: The car.

    Raises:
        InputError: The moment lies outside the labelled times, or is one of the first half second.
    """
    around = agents_of_log(log, now_s, np.array([-_SPEED_S, 0.0]), origin_ahead_m)
    line = shapely.LineString(centre_line)
    corridor = line.buffer(footprint.width_m / 2 + _ASIDE_M, cap_style="flat")
    front_m = line.project(shapely.Point(0.0, 0.0)) + footprint.ahead_m + footprint.length_m / 2
    middle_m = front_m - footprint.length_m / 2
    found: Lead | None = None
    for user in np.flatnonzero(around.there[1]).tolist():
        inside = corridor.intersection(shapely.Polygon(corners(around.boxes[1, user])))
        points = shapely.get_coordinates(inside)
        if not len(points):
            continue
        stations = shapely.line_locate_point(line, shapely.points(points))
        gap_m = float(stations.min()) - front_m
        # What reaches behind the middle of the car is beside it, or is the car itself.
        if stations.min() < middle_m or (found is not None and found.gap_m <= gap_m):
            continue
        before, now = around.boxes[:, user, :2]
        moved_m = line.project(shapely.Point(now)) - line.project(shapely.Point(before))
        found = Lead(gap_m, moved_m / _SPEED_S if around.there[0, user] else 0.0)
    return found


def _seen_from(ego_from_world: Float[np.ndarray, "4 4"], line_m: Line, origin_ahead_m: float) -> Line:
    """A line of a map in the planning frame; maps are flat, and lie as high as the car."""
    world_z_m = np.linalg.inv(ego_from_world)[2, 3]
    places = np.column_stack([line_m, np.full(len(line_m), world_z_m)])
    return planning_from_ego(
        (places @ ego_from_world[:3, :3].T + ego_from_world[:3, 3])[:, :2], origin_ahead_m
    )


def _own(lines: list[Line]) -> Line | None:
    """The line that the car at the origin is on."""
    found: list[tuple[float, float, Line]] = []
    for each in lines:
        line = shapely.LineString(each)
        away_m = line.distance(shapely.Point(0.0, 0.0))
        if away_m > _NEAR_M:
            continue
        station = line.project(shapely.Point(0.0, 0.0))
        step = int(np.searchsorted(_stations(each), station, side="right")) - 1
        ahead = each[min(step, len(each) - 2) :][:2]
        if _turn_rad(_AHEAD, ahead) < _ALONG_RAD:
            found.append((away_m, _turn_rad(each[:2], each[-2:]), each))
    if not found:
        return None
    nearest_m = min(away_m for away_m, _, _ in found)
    return min((each for each in found if each[0] <= nearest_m + _ALIKE_M), key=lambda each: each[1])[2]


def _following(line: Line, others: list[Line]) -> Line | None:
    """The straightest of the lines that begin where one ends."""
    joined = [each for each in others if np.linalg.norm(each[0] - line[-1]) < _JOIN_M]
    ahead = [each for each in joined if _turn_rad(line[-2:], each[:2]) < _ALONG_RAD]
    return min(ahead, key=lambda each: _turn_rad(line[-2:], each[-2:]), default=None)


def _heading(way: Line) -> float:
    x, y = way[-1] - way[0]
    return float(np.arctan2(y, x))


def _turn_rad(one: Line, other: Line) -> float:
    """How far another way points to the side of one."""
    return abs(math.remainder(_heading(other) - _heading(one), 2 * math.pi))


def _stations(line: Line) -> Float[np.ndarray, " n"]:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


def _length_m(line: Line) -> float:
    return float(_stations(line)[-1])
