"""Changes of one thing in a layout: a box elsewhere, a wider road."""

from collections.abc import Collection
from dataclasses import dataclass

import msgspec
import numpy as np
import shapely

from dreamdrive.scene.street.layout import Area, Box, Layout, Line, TrackPoint, is_moving, track_function
from dreamdrive.scene.street.truth import DriveTruth

VEHICLES = ("car", "van", "truck")
WAYS = {"left": np.pi / 2, "right": -np.pi / 2, "ahead": 0.0, "back": np.pi}
_CLEAR_M = 0.4
_EGO_CLEAR_M = 1.3


@dataclass(frozen=True)
class BoxEdit:
    """A layout in which one box stands or drives elsewhere.

    Attributes:
        layout: The changed layout.
        id: The box.
        way: ``left``, ``right``, ``ahead`` or ``back``, seen from its heading at the start.
        moved_m: x and y in the map by which all of its track is moved.
    """

    layout: Layout
    id: str
    way: str
    moved_m: np.ndarray


def move_box(seen: DriveTruth, moving: bool, metres: float, preferred: Collection[str] = ()) -> BoxEdit:
    """Move the vehicle that fills most pixels and has room, all of its track alike; preferred ones first."""
    layout = seen.world.layout
    pixels = {box.id: int((seen.instance == box.instance).sum()) for box in seen.boxes}
    fitting = [b for b in layout.boxes if b.kind in VEHICLES and is_moving(b.track) == moving]
    for box in sorted(fitting, key=lambda b: (b.id not in preferred, -pixels[b.id])):
        for way, turn in WAYS.items():
            yaw = box.track[0].yaw_rad + turn
            moved_m = metres * np.array([np.cos(yaw), np.sin(yaw)])
            elsewhere = _moved(box, moved_m)
            if _has_room(layout, elsewhere, seen.times_s):
                boxes = [elsewhere if other.id == box.id else other for other in layout.boxes]
                return BoxEdit(msgspec.structs.replace(layout, boxes=boxes), box.id, way, moved_m)
    raise SystemExit(
        f"the layout of seed {layout.seed} has no {'moving' if moving else 'parked'} box with room"
    )


def _moved(box: Box, by_m: np.ndarray) -> Box:
    track = [TrackPoint(p.t_s, p.x_m + float(by_m[0]), p.y_m + float(by_m[1]), p.yaw_rad) for p in box.track]
    return msgspec.structs.replace(box, track=track)


def _has_room(layout: Layout, box: Box, times_s: np.ndarray) -> bool:
    """Whether a box touches no other, no house, nothing upright and not the recording car at any time."""
    houses = shapely.union_all([shapely.Polygon(house.polygon) for house in layout.buildings])
    props = shapely.MultiPoint([prop.at_m for prop in layout.props])
    ego = shapely.points(track_function(layout.ego.track)(times_s)[:, :2])
    others = [other for other in layout.boxes if other.id != box.id]
    for t_s, car in zip(times_s, ego, strict=True):
        own = _footprint(box, t_s).buffer(_CLEAR_M)
        if own.intersects(houses) or own.intersects(props) or own.distance(car) < _EGO_CLEAR_M:
            return False
        if any(own.intersects(_footprint(other, t_s)) for other in others):
            return False
    return True


def _footprint(box: Box, t_s: float) -> shapely.Polygon:
    x, y, yaw = track_function(box.track)(np.array([t_s]))[0]
    half = np.array(box.size_m[:2]) / 2
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    corners = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) * half
    return shapely.Polygon(corners @ turn.T + (x, y))


def widen_road(layout: Layout, metres: float) -> Layout:
    """The right edge of a straight road that runs along x, with its kerb and its painted line, moved out."""
    road = np.array(next(area for area in layout.areas if area.kind == "road").polygon)
    if len(layout.areas) < 2 or np.ptp(road[:, 1]) > 40:
        raise SystemExit(f"the road of seed {layout.seed} is not straight; choose a seed that 3 divides")
    edge = road[:, 1].min() + 0.05
    line = min(y for a in layout.lines if a.kind == "road_edge" for _, y in a.points) + 0.05

    def out(points: list[tuple[float, float]], limit: float) -> list[tuple[float, float]]:
        return [(x, y - metres if y < limit else y) for x, y in points]

    def area(given: Area) -> Area:
        if given.kind == "road":
            return msgspec.structs.replace(given, polygon=out(given.polygon, edge))
        return msgspec.structs.replace(
            given, holes=[out(hole, edge) if given.kind == "sidewalk" else hole for hole in given.holes]
        )

    def painted(given: Line) -> Line:
        if given.kind != "road_edge":
            return given
        return msgspec.structs.replace(given, points=out(given.points, line))

    return msgspec.structs.replace(
        layout, areas=[area(a) for a in layout.areas], lines=[painted(x) for x in layout.lines]
    )
