"""The vector map of a log of Argoverse 2, in the layers of nuScenes' map expansion."""

from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float

from dreamdrive.data.formats.pandaset import Place
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, read_json
from dreamdrive.scene.street.log import LANE_CENTRE, LogMap, Polygon

_NAMES = "log_map_archive_*.json"
_FOR_CARS = ("VEHICLE", "BUS")
"""Types of lanes; those of bicycles have no layer in nuScenes, and are left out."""
_LONGEST_M, _MOST_M = 10_000.0, 1e6
"""Of a lane, and of all: each metre becomes a point."""
_STEP_M = 1.0
"""Between the points of a centre line, at most."""


class _Point(msgspec.Struct):
    x: Place
    y: Place


class _Lane(msgspec.Struct):
    lane_type: str
    is_intersection: bool
    left_lane_boundary: list[_Point]
    right_lane_boundary: list[_Point]


class _Crossing(msgspec.Struct):
    edge1: list[_Point]
    edge2: list[_Point]


class _Area(msgspec.Struct):
    area_boundary: list[_Point]


class _Map(msgspec.Struct):
    pedestrian_crossings: dict[str, _Crossing]
    lane_segments: dict[str, _Lane]
    drivable_areas: dict[str, _Area]


def find_maps(folder: Path) -> list[Path]:
    """Files of vector maps of a log; the data set has one, in the folder ``map``."""
    return sorted([*(folder / "map").glob(_NAMES), *folder.glob(_NAMES)])


def read_map(file: Path, problems: list[str]) -> LogMap:
    """The layers of a map: lanes, those of junctions as ``lane_connector``, crossings, the drivable area.

    Centre lines run halfway between the borders of their lanes, in the direction of travel.

    Args:
        file: ``log_map_archive_*.json``.
        problems: Takes what is wrong, in sentences.

    Raises:
        InputError: The file cannot be read, or is no map of Argoverse 2.
    """
    given = of_type(read_json(file), _Map, str(file))
    lanes = [each for each in given.lane_segments.values() if each.lane_type in _FOR_CARS]
    borders = [(_places(each.left_lane_boundary), _places(each.right_lane_boundary)) for each in lanes]
    lengths_m = [(_length_m(left), _length_m(right)) for left, right in borders]
    whole = [min(both) > 0 and max(both) <= _LONGEST_M for both in lengths_m]
    if not all(whole):
        problems.append(
            f"{file.name}: {len(whole) - sum(whole)} lanes have no borders, or such of over "
            f"{_LONGEST_M / 1000:g} km, and are left out"
        )
    if (all_m := sum(max(both) for both, good in zip(lengths_m, whole, strict=True) if good)) > _MOST_M:
        raise InputError(f"{file} has {all_m / 1000:.0f} km of lanes; expected those around one drive")
    inner: dict[bool, list[Polygon]] = {False: [], True: []}
    for lane, (left, right), good in zip(lanes, borders, whole, strict=True):
        if good:
            inner[lane.is_intersection].append(Polygon(np.concatenate([left, right[::-1]])))
    edges = [(_places(each.edge1), _places(each.edge2)) for each in given.pedestrian_crossings.values()]
    crossings = [np.concatenate([one, other[::-1]]) for one, other in edges]
    areas = [_places(each.area_boundary) for each in given.drivable_areas.values()]
    return LogMap(
        {
            "drivable_area": _polygons(areas, file, problems),
            "lane": tuple(inner[False]),
            "lane_connector": tuple(inner[True]),
            "ped_crossing": _polygons(crossings, file, problems),
        },
        {LANE_CENTRE: tuple(_middle(*pair) for pair, good in zip(borders, whole, strict=True) if good)},
    )


def _places(points: list[_Point]) -> Float[np.ndarray, "n 2"]:
    return np.array([(point.x, point.y) for point in points], np.float64).reshape(-1, 2)


def _length_m(line: Float[np.ndarray, "n 2"]) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def _polygons(rings: list[Float[np.ndarray, "_ 2"]], file: Path, problems: list[str]) -> tuple[Polygon, ...]:
    """Rings without the last point that repeats the first; those that enclose nothing are left out."""
    open_ = [ring[:-1] if len(ring) > 1 and (ring[0] == ring[-1]).all() else ring for ring in rings]
    good = [ring for ring in open_ if len(ring) > 2]
    if len(good) < len(rings):
        problems.append(f"{file.name}: {len(rings) - len(good)} areas have under three corners; left out")
    return tuple(Polygon(ring) for ring in good)


def _middle(left: Float[np.ndarray, "n 2"], right: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, "k 2"]:
    """The line halfway between two, point by point at the same share of their lengths."""
    count = max(2, 1 + int(np.ceil(max(_length_m(left), _length_m(right)) / _STEP_M)))
    return (_spread(left, count) + _spread(right, count)) / 2


def _spread(line: Float[np.ndarray, "n 2"], count: int) -> Float[np.ndarray, "k 2"]:
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    wanted = np.linspace(0, along[-1], count)
    return np.column_stack([np.interp(wanted, along, line[:, axis]) for axis in range(2)])
