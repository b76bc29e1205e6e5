"""The roads of a drawn street of the first edition, read from the lines of its map."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from jaxtyping import Float
from shapely.geometry.base import BaseGeometry

from dreamdrive.scene.street.layout import Layout, Line
from streetworld import LANE_M, Road

_ON_LINE_M = 0.01
_JUNCTION_M = 3.0  # from the kerb to the stop line
_POST_M = 0.4  # around the middle of a trunk or a post


@dataclass(frozen=True)
class Street:
    """A drawn street and its roads.

    Attributes:
        layout: As it was drawn.
        main: The road that the ego drives on; its station 0 is the origin of the map.
        other: The road that crosses it, if any; its station 0 is where they cross.
    """

    layout: Layout
    main: Road
    other: Road | None

    @property
    def lane_left_m(self) -> float:
        """Where the middle of the ego's lane lies: the rightmost of the main road."""
        return -(self.main.lanes - 0.5) * LANE_M

    @property
    def crossing_m(self) -> float | None:
        """Station of the main road where the other one crosses."""
        return None if self.other is None else float(self.other.at(np.zeros(1))[0, 0])

    @cached_property
    def houses(self) -> BaseGeometry:
        """The ground under all houses, prepared."""
        ground = shapely.union_all([shapely.Polygon(house.polygon) for house in self.layout.buildings])
        shapely.prepare(ground)
        return ground

    @cached_property
    def solid(self) -> BaseGeometry:
        """The ground under houses, trees and posts, prepared."""
        posts = [shapely.Point(prop.at_m).buffer(_POST_M) for prop in self.layout.props]
        ground = shapely.union_all([self.houses, *posts])
        shapely.prepare(ground)
        return ground

    def in_junction(self, first_m: float, last_m: float) -> bool:
        """Whether what stands between two stations of the main road stands in the junction."""
        if self.other is None or self.crossing_m is None:
            return False
        reach = self.other.half_m + _JUNCTION_M
        return first_m < self.crossing_m + reach and last_m > self.crossing_m - reach


def street_of(layout: Layout) -> Street:
    """The roads of a layout that ``draw_street`` drew in the first edition."""
    pieces = [(line, np.array(line.points)) for line in layout.lines]
    first, points = next((line, at) for line, at in pieces if _through_origin(line, at))
    lanes = 2 if first.kind == "road_divider" else 1
    along = points[-1] - points[-2]
    along = along / np.linalg.norm(along)
    # Behind a junction, which is crossed straight on, the line goes on.
    behind = [at for line, at in pieces if line.kind == first.kind and _continues(points[-1], along, at)]
    main = _road(np.concatenate([points, *behind]), lanes)
    return Street(layout, main, _crossing_road(layout) if behind else None)


def _through_origin(line: Line, points: Float[np.ndarray, "n 2"]) -> bool:
    near = np.abs(points[:, 0]).argmin()
    return line.kind in ("road_divider", "lane_divider") and bool(abs(points[near, 1]) < _ON_LINE_M)


def _continues(
    end: Float[np.ndarray, "2"], along: Float[np.ndarray, "2"], points: Float[np.ndarray, "n 2"]
) -> bool:
    away = points - end
    aside = np.abs(away[:, 0] * along[1] - away[:, 1] * along[0])
    return bool((aside < _ON_LINE_M).all() and (away @ along > _ON_LINE_M).all())


def _road(points: Float[np.ndarray, "n 2"], lanes: int) -> Road:
    """A road along a line that passes the origin, which becomes station 0."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    way -= np.interp(0.0, points[:, 0], way)
    stations = np.arange(np.ceil(way[0]), way[-1])
    even = np.column_stack([np.interp(stations, way, points[:, axis]) for axis in (0, 1)])
    steps = np.gradient(even, axis=0)
    return Road(even, np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])), float(stations[0]), lanes)


def _crossing_road(layout: Layout) -> Road:
    """The road across the main one, which runs along x: half-way between its edges."""
    edges = [np.array(line.points) for line in layout.lines if line.kind == "road_edge"]
    edges = [edge for edge in edges if np.ptp(edge[:, 1]) > np.ptp(edge[:, 0])]
    along = edges[0][-1] - edges[0][0]
    along = along * np.sign(along[1]) / np.linalg.norm(along)
    left = np.array([-along[1], along[0]])
    aside = np.array([float((edge @ left).mean()) for edge in edges])
    middle = (aside.max() + aside.min()) / 2 * left
    crossing = middle - middle[1] / along[1] * along
    ways = np.concatenate([(edge - crossing) @ along for edge in edges])
    stations = np.arange(np.ceil(ways.min()), ways.max())
    heading = np.full(len(stations), np.arctan2(along[1], along[0]))
    lanes = round(float(np.ptp(aside)) / (2 * LANE_M))
    return Road(crossing + stations[:, None] * along, heading, float(stations[0]), lanes)
