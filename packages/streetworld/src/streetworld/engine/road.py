"""The road net of a drawn street: a main road, perhaps a road that crosses it, and what both are made of."""

from dataclasses import dataclass
from typing import cast

import numpy as np
import shapely
from jaxtyping import Float
from shapely.geometry.base import BaseGeometry

from dreamdrive.scene.street.layout import Area, AreaKind, Line, LineKind

LANE_M, PARKING_M, SIDEWALK_M = 3.4, 2.2, 3.2
_STEP_M = 1.0
_CORNER_M = 4.0
_BEHIND_M, _AHEAD_M, _BESIDE_M = 45.0, 190.0, 90.0
_SIGHT_M = 90.0
_CHANGE_S = 4.0
MOST_M_S = 16.0
"""Speed that no vehicle comes to go beyond."""
_OTHERS_SHARE = 10 / 16
"""Speed of what comes or crosses, at most, as a share of that."""


@dataclass(frozen=True)
class Curve:
    """A line in the map, given every metre from station ``start_m`` on; headings are in radians."""

    points: Float[np.ndarray, "n 2"]
    headings: Float[np.ndarray, " n"]
    start_m: float

    @property
    def end_m(self) -> float:
        """Station of the last point."""
        return self.start_m + (len(self.points) - 1) * _STEP_M

    def at(
        self, station_m: Float[np.ndarray, " k"], left_m: float | np.ndarray = 0.0
    ) -> Float[np.ndarray, "k 3"]:
        """x, y and heading (K, 3) at stations along the line, to the left of it."""
        grid = self.start_m + _STEP_M * np.arange(len(self.points))
        x, y = (np.interp(station_m, grid, self.points[:, i]) for i in (0, 1))
        heading = np.interp(station_m, grid, self.headings)
        return np.stack([x - left_m * np.sin(heading), y + left_m * np.cos(heading), heading], axis=-1)

    def strip(
        self, right_m: float, left_m: float, start_m: float | None = None, end_m: float | None = None
    ) -> shapely.Polygon:
        """What lies between two distances from the line, left counted positive."""
        first = self.start_m if start_m is None else start_m
        last = self.end_m if end_m is None else end_m
        stations = np.linspace(first, last, 2 * len(self.points))
        right, left = self.at(stations, right_m)[:, :2], self.at(stations, left_m)[:, :2]
        return shapely.Polygon(np.concatenate([right, left[::-1]]))

    def block(self, station_m: float, wide_m: float, near_m: float, far_m: float) -> shapely.Polygon:
        """A rectangle beside it, its front along it."""
        front = self.at(np.array([station_m, station_m + wide_m]), near_m)[:, :2]
        along = (front[1] - front[0]) / np.linalg.norm(front[1] - front[0])
        out = np.array([-along[1], along[0]]) * (far_m - near_m)
        return shapely.Polygon([front[0], front[1], front[1] + out, front[0] + out])

    def line(self, left_m: float) -> shapely.LineString:
        """A line beside it."""
        stations = np.linspace(self.start_m, self.end_m, len(self.points))
        return shapely.LineString(self.at(stations, left_m)[:, :2])


@dataclass(frozen=True)
class Road(Curve):
    """A road along a middle line; lanes are those of each direction."""

    lanes: int

    @property
    def half_m(self) -> float:
        """From the middle line to the kerb."""
        return self.lanes * LANE_M + PARKING_M


def bent_road(bend_per_m: float, bend_from_m: float, lanes: int, way_m: float) -> Road:
    """Through the map's origin along x at station 0; from ``bend_from_m`` on it gradually turns.

    It is long enough for what goes ``way_m`` ahead and for what is seen from there, and for what comes.
    """
    behind = np.ceil(max(_BEHIND_M, _OTHERS_SHARE * way_m))
    stations = np.arange(-behind, np.ceil(max(_AHEAD_M, way_m + _SIGHT_M)), _STEP_M)
    bend = bend_per_m * np.clip((stations - bend_from_m) / 15.0, 0, 1)
    # Nothing turns by more than a right angle within sight.
    heading = np.clip(np.cumsum(bend) * _STEP_M, -1.5, 1.5)
    steps = _STEP_M * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    points = np.cumsum(steps, axis=0)
    return Road(points - points[int(behind)], heading, -float(behind), lanes)


def crossing_road(main: Road, station_m: float, angle_rad: float, lanes: int, way_m: float) -> Road:
    """A straight road across the main one, leading to the left; its station 0 is where they cross."""
    x, y, heading = main.at(np.array([station_m]))[0]
    heading += angle_rad
    beside = float(np.ceil(max(_BESIDE_M, _OTHERS_SHARE * way_m)))
    stations = np.arange(-beside, beside + 1, _STEP_M)
    points = np.array([x, y]) + stations[:, None] * [np.cos(heading), np.sin(heading)]
    return Road(points, np.full(len(stations), heading), -beside, lanes)


@dataclass(frozen=True)
class RoadNet:
    """Roads as polygons: the main road, then the one that crosses it, if any.

    ``crossing_m`` is the station of the crossing on the main road; all between kerbs is paved.
    """

    roads: tuple[Road, ...]
    crossing_m: float | None
    paved: shapely.Polygon
    walks: BaseGeometry

    @staticmethod
    def of(roads: tuple[Road, ...], crossing_m: float | None) -> "RoadNet":
        """Join the roads, their corners rounded."""
        whole = shapely.union_all([road.strip(-road.half_m, road.half_m) for road in roads])
        paved = whole.buffer(_CORNER_M).buffer(-_CORNER_M).simplify(0.02)
        walks = paved.buffer(SIDEWALK_M).difference(paved).simplify(0.02)
        return RoadNet(roads, crossing_m, cast(shapely.Polygon, paved), walks)

    @property
    def junction(self) -> shapely.Polygon:
        """Where roads overlap, with what lies up to the stop lines; empty without a crossing."""
        if len(self.roads) < 2:
            return shapely.Polygon()
        first, second = (road.strip(-road.half_m, road.half_m) for road in self.roads)
        return first.intersection(second).buffer(3.0, join_style="mitre")

    def areas(self, zebras: list[shapely.Polygon]) -> list[Area]:
        """The map's polygons."""
        found = [*map_areas("road", self.paved), *map_areas("sidewalk", self.walks)]
        return found + [area for zebra in zebras for area in map_areas("crossing", zebra)]

    def lines(self) -> list[Line]:
        """The map's paint, left out inside the junction."""
        found: list[Line] = []
        for road in self.roads:
            middle: LineKind = "road_divider" if road.lanes > 1 else "lane_divider"
            found += map_lines(middle, road.line(0.0), self.junction)
            for side in (-1, 1):
                for lane in range(1, road.lanes):
                    found += map_lines("lane_divider", road.line(side * lane * LANE_M), self.junction)
                found += map_lines("road_edge", road.line(side * road.lanes * LANE_M), self.junction)
        if self.crossing_m is not None:
            main, other = self.roads
            before = self.crossing_m - other.half_m - 3.2
            ends = main.at(np.array([before, before]), np.array([0.0, -main.lanes * LANE_M]))[:, :2]
            found.append(Line(kind="stop_line", points=map_points(ends)))
        return found


def map_points(values: np.ndarray) -> list[tuple[float, float]]:
    """Places (N, 2) as a layout writes them, to the millimetre."""
    return [(round(float(x), 3), round(float(y), 3)) for x, y in values]


def _ring(ring: shapely.LinearRing) -> list[tuple[float, float]]:
    return map_points(np.array(ring.coords)[:-1])


def map_areas(kind: AreaKind, shape: BaseGeometry) -> list[Area]:
    """The polygons of a shape as areas."""
    return [
        Area(kind=kind, polygon=_ring(part.exterior), holes=[_ring(hole) for hole in part.interiors])
        for part in shapely.get_parts(shape)
        if part.area > 0.05
    ]


def map_lines(kind: LineKind, line: shapely.LineString, outside: BaseGeometry) -> list[Line]:
    """What of a line lies outside a shape, as lines of the map."""
    rest = line.difference(outside) if not outside.is_empty else line
    return [
        Line(kind=kind, points=map_points(np.array(part.coords)))
        for part in shapely.get_parts(rest)
        if part.length > 1
    ]


def travelled_m(
    times_s: Float[np.ndarray, " t"], speed_m_s: float, change_m_s2: float, least_m_s: float = 0.0
) -> Float[np.ndarray, " t"]:
    """Way gone by times (T,) since 0 at a pace that changes for a while and then stays.

    The change lasts four seconds at most, and ends where the speed comes to its lowest or ``MOST_M_S``.
    """
    way = speed_m_s * times_s + 0.5 * change_m_s2 * times_s**2
    if change_m_s2 == 0:
        return way
    bound = least_m_s if change_m_s2 < 0 else MOST_M_S
    lasts_s = min(_CHANGE_S, max((bound - speed_m_s) / change_m_s2, 0.0))
    then = speed_m_s * lasts_s + 0.5 * change_m_s2 * lasts_s**2
    pace = speed_m_s + change_m_s2 * lasts_s
    return np.where(times_s <= lasts_s, way, then + pace * (times_s - lasts_s))


def rectangle_around(polygon: shapely.Polygon) -> Float[np.ndarray, "5 2"]:
    """Corners of the smallest rectangle around a polygon, the first one repeated."""
    return shapely.get_coordinates(shapely.oriented_envelope(polygon))
