"""Roads of the second edition: what lies across them, how they wind, where they meet."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, cast

import numpy as np
import shapely
from jaxtyping import Float
from scipy.ndimage import uniform_filter1d
from shapely.geometry.base import BaseGeometry

from dreamdrive.scene.street.layout import Area, AreaKind, Line, LineKind
from streetworld.engine.road import Curve, map_areas, map_lines, map_points

Middle = Literal["none", "dashed", "solid", "grass", "paved", "rail"]
Parking = Literal["none", "parallel", "angled", "perpendicular"]
PARKING_DEPTH_M: dict[Parking, float] = {
    "none": 0.0,
    "parallel": 2.2,
    "angled": 4.7,
    "perpendicular": 5.1,
}
PARKING_PITCH_M: dict[Parking, float] = {"none": 0.0, "parallel": 6.0, "angled": 3.3, "perpendicular": 2.6}
"""Length of kerb that a vehicle takes."""
PARKING_TURN_RAD: dict[Parking, float] = {
    "none": 0.0,
    "parallel": 0.0,
    "angled": np.deg2rad(55),
    "perpendicular": np.pi / 2,
}
_STOP_M = 1.2  # from a stop line to the zebra crossing or junction behind it
_EASE_M = 14  # over which a bend begins
_MOST_TURN_RAD = 1.35
_BAYS_M = 90.0  # from station 0, how far bays of a car park are painted


@dataclass(frozen=True)
class RoadSide:
    """One side of a road from its middle outwards; widths in metres."""

    lanes: int
    shoulder_m: float = 0.0
    parking: Parking = "none"
    verge_m: float = 0.0
    walk_m: float = 0.0


@dataclass(frozen=True)
class Section:
    """What lies across a road; traffic ahead goes on the right.

    Marked ones have painted lanes, those with ``edges`` lines at their kerbs as well.
    """

    right: RoadSide
    left: RoadSide
    lane_m: float
    middle: Middle = "none"
    middle_m: float = 0.0
    marked: bool = True
    edges: bool = False


@dataclass(frozen=True)
class Way(Curve):
    """A road along the line between its directions. Sides are -1 (right) and 1 (left)."""

    section: Section

    def side(self, side: int) -> RoadSide:
        """The right or left side."""
        return self.section.right if side < 0 else self.section.left

    def lane_m(self, side: int, lane: int) -> float:
        """Distance of the middle of a lane, counted from the road's middle on; left is positive."""
        return side * (self.section.middle_m / 2 + (lane + 0.5) * self.section.lane_m)

    def edge_m(self, side: int) -> float:
        """From the middle line to the outer edge of the lanes."""
        return self.section.middle_m / 2 + self.side(side).lanes * self.section.lane_m

    def kerb_m(self, side: int) -> float:
        """From the middle line to the kerb."""
        which = self.side(side)
        return self.edge_m(side) + which.shoulder_m + PARKING_DEPTH_M[which.parking]

    def walk_m(self, side: int) -> tuple[float, float]:
        """From the middle line to both edges of the sidewalk."""
        start = self.kerb_m(side) + self.side(side).verge_m
        return start, start + self.side(side).walk_m

    def paved(self, start_m: float | None = None, end_m: float | None = None) -> shapely.Polygon:
        """All between the kerbs."""
        return self.strip(-self.kerb_m(-1), self.kerb_m(1), start_m, end_m)


def winding(
    rng: np.random.Generator, radius_m: tuple[float, float], share: float, behind_m: float, ahead_m: float
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, " n"], float]:
    """Points every metre, headings and first station of a line along x at the origin, with random bends.

    ``share`` of its stretches bend, with radii of that range. It never turns back, so never meets itself.
    """
    behind, ahead = int(np.ceil(behind_m)), int(np.ceil(ahead_m))
    bend = np.zeros(behind + ahead)
    at = 0
    while at < len(bend):
        length = int(rng.uniform(15, 80))
        radius = np.exp(rng.uniform(*np.log(radius_m)))
        turn = min(1 / radius, 1.6 / length)
        bend[at : at + length] = turn * rng.choice([-1, 1]) * (rng.random() < share)
        at += length
    heading = np.cumsum(uniform_filter1d(bend, _EASE_M))
    heading = np.clip(heading - heading[behind], -_MOST_TURN_RAD, _MOST_TURN_RAD)
    points = np.cumsum(np.stack([np.cos(heading), np.sin(heading)], axis=-1), axis=0)
    return points - points[behind], heading, -float(behind)


def branch(
    main: Way, station_m: float, angle_rad: float, section: Section, reach_m: tuple[float, float]
) -> Way:
    """A straight road across the main one, from so far to its right to so far to its left."""
    x, y, heading = main.at(np.array([station_m]))[0]
    heading += angle_rad
    stations = np.arange(-np.ceil(reach_m[0]), np.ceil(reach_m[1]) + 1)
    points = np.array([x, y]) + stations[:, None] * [np.cos(heading), np.sin(heading)]
    return Way(points, np.full(len(stations), heading), float(stations[0]), section)


@dataclass(frozen=True)
class Junction:
    """Where another road meets the main one at a station; arms are those of zebra crossings."""

    station_m: float
    other: Way
    shape: shapely.Polygon
    zebras: list[shapely.Polygon]
    stops: list[np.ndarray]


@dataclass(frozen=True)
class Net:
    """The main road, then those that meet it, and those beside it."""

    main: Way
    junctions: tuple[Junction, ...]
    beside: tuple[Way, ...]
    corner_m: float
    ground: AreaKind = "road"

    @cached_property
    def ways(self) -> tuple[Way, ...]:
        """All roads, the main one first."""
        return (self.main, *(j.other for j in self.junctions), *self.beside)

    @cached_property
    def crossed(self) -> BaseGeometry:
        """All junctions up to their stop lines."""
        return shapely.union_all([j.shape for j in self.junctions])

    @cached_property
    def paved(self) -> BaseGeometry:
        """All between kerbs, corners rounded."""
        whole = shapely.union_all([way.paved() for way in self.ways])
        return _tidy(_closed(whole, self.corner_m))

    @cached_property
    def walks(self) -> BaseGeometry:
        """Sidewalks."""
        strips = [self.paved]
        for way in self.ways:
            for side in (-1, 1):
                near, far = sorted(side * m for m in way.walk_m(side))
                if far - near > 0.1:
                    strips.append(way.strip(near, far))
        whole = _closed(shapely.union_all(strips), self.corner_m)
        return _tidy(whole.difference(self.paved).buffer(-0.05).buffer(0.05, join_style="mitre"))

    @cached_property
    def middles(self) -> BaseGeometry:
        """Raised or green strips between directions."""
        strips = [
            way.strip(-way.section.middle_m / 2, way.section.middle_m / 2)
            for way in self.ways
            if way.section.middle in ("grass", "paved")
        ]
        strips = [s.difference(self.crossed.buffer(2.0)).buffer(-0.1) for s in strips]
        return _tidy(shapely.union_all(strips))

    @cached_property
    def zebras(self) -> list[shapely.Polygon]:
        """Zebra crossings of all junctions."""
        return [zebra for junction in self.junctions for zebra in junction.zebras]

    def areas(self, zebras: list[shapely.Polygon]) -> list[Area]:
        """The map's polygons."""
        raised: AreaKind = "grass" if self.main.section.middle == "grass" else "sidewalk"
        lanes = _tidy(self.paved.difference(self.middles))
        found = [*map_areas(self.ground, lanes), *map_areas("sidewalk", self.walks)]
        found += map_areas(raised, self.middles)
        return found + [area for zebra in zebras for area in map_areas("crossing", zebra)]

    def lines(self) -> list[Line]:
        """The map's paint, left out inside junctions."""
        found: list[Line] = []
        for way in self.ways:
            found += self._along(way) if way.section.marked else []
            if self.ground == "parking" and way.section.marked:
                found += _bays(way)
        stops = [stop for junction in self.junctions for stop in junction.stops]
        return found + [Line("stop_line", map_points(stop)) for stop in stops]

    def _along(self, way: Way) -> list[Line]:
        section, found = way.section, list[Line]()
        painted: dict[Middle, list[tuple[LineKind, float]]] = {
            "dashed": [("lane_divider", 0.0)],
            "solid": [("road_divider", 0.0)],
        }
        wanted: list[tuple[LineKind, float]] = painted.get(section.middle, [])
        if section.middle in ("grass", "paved", "rail"):
            wanted = [("road_edge", side * (section.middle_m / 2 - 0.15)) for side in (-1, 1)]
        for side in (-1, 1):
            which = way.side(side)
            for lane in range(1, which.lanes):
                wanted.append(("lane_divider", side * (section.middle_m / 2 + lane * section.lane_m)))
            if which.shoulder_m > 0.3 or which.parking != "none" or section.edges:
                inside = 0.0 if which.shoulder_m + PARKING_DEPTH_M[which.parking] > 0.3 else 0.2
                wanted.append(("road_edge", side * (way.edge_m(side) - inside)))
        for kind, left_m in wanted:
            found += map_lines(kind, cast(shapely.LineString, way.line(left_m).simplify(0.01)), self.crossed)
        return found


def junction(
    rng: np.random.Generator, main: Way, station_m: float, other: Way, *, zebra: bool, stop: bool
) -> Junction:
    """Where another road meets the main one, with zebra crossings over some of its arms."""
    wide_m = float(rng.uniform(2.2, 4.0))
    overlap = main.paved(station_m - 40, station_m + 40).intersection(other.paved())
    gap_m = float(rng.uniform(0.6, 3.0))
    shape = overlap.buffer(gap_m + (wide_m if zebra else 0) + _STOP_M, join_style="mitre")
    zebras: list[shapely.Polygon] = []
    stops: list[np.ndarray] = []
    arms = [(main, station_m, s) for s in (-1, 1)] + [(other, 0.0, s) for s in (-1, 1)]
    for way, middle_m, end in arms:
        across = other if way is main else main
        near = middle_m + end * (max(across.kerb_m(-1), across.kerb_m(1)) + gap_m)
        if not way.start_m < near < way.end_m:
            continue
        if zebra and rng.random() < 0.75:
            zebras.append(way.paved(*sorted((near, near + end * wide_m))))
        lanes = way.side(end).lanes
        if stop and lanes:
            line_m = near + end * (_STOP_M + (wide_m if zebra else 0))
            at = np.array([end * way.section.middle_m / 2, end * way.edge_m(end)])
            stops.append(way.at(np.full(2, line_m), at)[:, :2])
    return Junction(station_m, other, shape, zebras, stops)


def _bays(way: Way) -> list[Line]:
    """Lines between the places of a car park."""
    found: list[Line] = []
    for side in (-1, 1):
        parking = way.side(side).parking
        if parking in ("none", "parallel"):
            continue
        near, far = way.kerb_m(side) - PARKING_DEPTH_M[parking], way.kerb_m(side)
        lean = (far - near) / np.tan(PARKING_TURN_RAD[parking])
        for station in np.arange(max(way.start_m, -_BAYS_M / 3), _BAYS_M, PARKING_PITCH_M[parking]):
            ends = way.at(np.array([station, station + side * -lean]), side * np.array([near, far]))[:, :2]
            found.append(Line("road_edge", map_points(ends)))
    return found


def _tidy(shape: BaseGeometry) -> BaseGeometry:
    """The same with fewer corners, all of them whole centimetres and so as a layout writes them."""
    return shapely.set_precision(shape.simplify(0.02), 0.01)


def _closed(shape: BaseGeometry, radius_m: float) -> BaseGeometry:
    """A shape with its inner corners rounded."""
    return shape.buffer(radius_m).buffer(-radius_m)
