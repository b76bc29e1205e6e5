"""The drives that the geometry benchmark draws: straight, round a bend, round a corner, and standing."""

from functools import lru_cache

import numpy as np
import shapely
from jaxtyping import Float
from msgspec.structs import replace

from dreamdrive.scene.street.layout import Ego, Layout, TrackPoint, track_function
from dreamdrive.scene.street.truth import DriveTruth
from streetworld import StreetOptions, draw_street, drive

# Of three seeds one street is straight, one bends and one crosses another.
SEEDS = {
    "straight a": 0,
    "straight b": 3,
    "bend a": 1,
    "bend b": 4,
    "corner a": 2,
    "corner b": 5,
    "standing": 6,
}
CORNER_SPEED_M_S = 6.0
_RADII_M = (7.0, 9.0, 12.0)
_STEP_M = 0.6  # between the points of a track
_TO_CORNER_S = 7.0  # by then a drive at that speed has passed the crossing


@lru_cache(maxsize=2)
def world_of(
    name: str, frames: int, rate_hz: float, size: tuple[int, int], movers: int | None = None
) -> DriveTruth:
    """The drive of a name in ``SEEDS``, its truth exact.

    Args:
        name: Which one.
        frames: Number of frames.
        rate_hz: Frames a second.
        size: Width and height in pixels.
        movers: Number of moving road users; None leaves it to the seed.
    """
    seconds = frames / rate_hz
    corner, stands = name.startswith("corner"), name == "standing"
    speed = CORNER_SPEED_M_S if corner else 0.0 if stands else None
    drawn_s = max(seconds, _TO_CORNER_S) if corner else seconds
    layout = draw_street(SEEDS[name], StreetOptions(drawn_s, speed, movers))
    if corner:
        layout = replace(layout, ego=round_the_corner(layout, seconds))
    return drive(layout, frames, rate_hz, size)


def round_the_corner(layout: Layout, seconds: float) -> Ego:
    """The recording car turns off where it has most room: from the edge of the road and from road users."""
    road = shapely.union_all(
        [shapely.Polygon(a.polygon, a.holes) for a in layout.areas if a.kind in ("road", "crossing")]
    )
    times = np.arange(0, seconds + 0.2, _STEP_M / CORNER_SPEED_M_S)
    begins = track_function(layout.ego.track)(np.arange(0, _TO_CORNER_S, 0.5))
    ways = [
        turned(begin, straight, side, radius, CORNER_SPEED_M_S * times)
        for begin in begins
        for straight in (6.0, 8.0, 10.0)
        for side in (-1, 1)
        for radius in _RADII_M
    ]
    best = max(ways, key=lambda way: _room_m(way, times, road, layout))
    track = [TrackPoint(float(t), *map(float, place)) for t, place in zip(times, best, strict=True)]
    return replace(layout.ego, track=track)


def turned(
    start: Float[np.ndarray, "3"],
    straight_m: float,
    side: int,
    radius_m: float,
    way_m: Float[np.ndarray, " t"],
) -> Float[np.ndarray, "t 3"]:
    """Places x, y, yaw along a way: straight on, a quarter of a circle, straight on.

    Args:
        start: Place and heading at its begin.
        straight_m: Length before the curve.
        side: 1 turns to the left, -1 to the right.
        radius_m: Of the curve.
        way_m: Distances (T,) from the begin.
    """
    angle = np.clip((way_m - straight_m) / radius_m, 0, np.pi / 2)
    beyond = np.maximum(way_m - straight_m - radius_m * np.pi / 2, 0)
    ahead = np.minimum(way_m, straight_m) + radius_m * np.sin(angle)
    left = side * (radius_m * (1 - np.cos(angle)) + beyond)
    cos, sin = np.cos(start[2]), np.sin(start[2])
    x, y = start[0] + cos * ahead - sin * left, start[1] + sin * ahead + cos * left
    return np.stack([x, y, start[2] + side * angle], axis=1)


def _room_m(
    way: Float[np.ndarray, "t 3"], times: Float[np.ndarray, " t"], road: shapely.Geometry, layout: Layout
) -> float:
    """Distance of the nearest edge of the road or road user; below 0 off the road, or where no curve is."""
    if abs(way[-1, 2] - way[0, 2]) < np.pi / 2 - 1e-6:
        return -np.inf
    places = shapely.points(way[:, :2])
    inside = np.where(shapely.contains(road, places), 1.0, -1.0)
    room = float((inside * shapely.distance(road.boundary, places)).min())
    for box in layout.boxes:
        theirs = track_function(box.track)(times)[:, :2]
        reach = 0.5 * box.size_m[0] + 2.0
        room = min(room, float(np.linalg.norm(theirs - way[:, :2], axis=1).min()) - reach)
    return room
