"""Maps of nuScenes: the map expansion, the pictures of the drivable area, and pictures of several layers."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import cv2
import msgspec
import numpy as np
from jaxtyping import Bool, Float
from msgspec import Meta

from dreamdrive.data.formats.pandaset import Place
from dreamdrive.data.pictures.picture_file import read_picture
from dreamdrive.datasets.nuscenes.tables import MapRow, Tables
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import JSON_RAISES, of_type, read_json
from dreamdrive.files.paths import is_inside, is_path, read_bytes
from dreamdrive.scene.street.log import LogMap, Polygon

AREAS = (
    "drivable_area",
    "road_segment",
    "road_block",
    "lane",
    "lane_connector",
    "ped_crossing",
    "walkway",
    "stop_line",
    "carpark_area",
)
LINES = ("road_divider", "lane_divider")
LAYERS_FILE = "README.json"
"""Says where pictures of layers lie, see ``_Layers``."""
OF_PICTURES = {"road": "drivable_area", "driveway": "carpark_area", "sidewalk": "walkway"}
"""Layers of pictures by their file names, in the words of the map expansion."""
_MASK_M = 0.1
"""Size of a pixel of a picture of the drivable area (nuScenes devkit, ``MapMask``)."""
_LEAST_M2 = 1.0
"""Specks of a picture that are no area."""
_EXPANSION_BYTES = 400_000_000

Within = Float[np.ndarray, "2 2"]


class _Node(msgspec.Struct):
    token: str
    x: Place
    y: Place


class _Line(msgspec.Struct):
    token: str
    node_tokens: list[str]


class _Hole(msgspec.Struct):
    node_tokens: list[str]


class _Polygon(msgspec.Struct):
    token: str
    exterior_node_tokens: list[str]
    holes: list[_Hole] = []


class _Feature(msgspec.Struct):
    token: str
    polygon_token: str | None = None
    polygon_tokens: list[str] | None = None
    line_token: str | None = None


class _Shapes(msgspec.Struct):
    node: list[_Node]
    line: list[_Line]
    polygon: list[_Polygon]


class _Layers(msgspec.Struct):
    """Pictures beside it, a layer each: row 0 is at the lowest y, and what is not black is covered."""

    resolution_m: Annotated[float, Meta(gt=0, le=10)]
    origin_xy_of_pixel_0_0: tuple[Place, Place]


def map_of(tables: Tables, log_token: str, location: str, within: Within) -> LogMap:
    """The map around a drive: of the map expansion, else of pictures; empty where there is neither."""
    folder = tables.root / "maps"
    try:
        expansion = _expansion(folder, location)
        if expansion is not None:
            return read_expansion(expansion, within, tables)
        if (folder / LAYERS_FILE).is_file():
            return _of_layers(folder, within)
        return _of_mask(tables, log_token, within)
    except InputError as error:
        tables.fault(f"{error}: there is no map")
        return LogMap()


def _expansion(folder: Path, location: str) -> Path | None:
    """The map expansion of a place; it lies in ``maps/expansion``, of older versions in ``maps``."""
    if not location or not is_inside(location):
        return None
    found = [
        p for p in (folder / "expansion" / f"{location}.json", folder / f"{location}.json") if p.is_file()
    ]
    if len(found) == 2 and _content(found[0]) != _content(found[1]):
        raise InputError(
            f"there are two maps of the name {location}, {found[0]} and {found[1]}, which differ; "
            "take one away"
        )
    return found[0] if found else None


def _content(path: Path) -> bytes:
    return read_bytes(path, at_most=_EXPANSION_BYTES)


def read_expansion(path: Path, within: Within, tables: Tables) -> LogMap:
    """Layers of a map expansion that reach into a rectangle."""
    try:
        data = _content(path)
        shapes = msgspec.json.decode(data, type=_Shapes)
        layers = msgspec.json.decode(data, type=dict[str, msgspec.Raw])
        features = {
            name: msgspec.json.decode(layers[name], type=list[_Feature])
            for name in (*AREAS, *LINES)
            if name in layers
        }
    except JSON_RAISES as error:
        raise InputError(f"{path} is damaged or no map expansion ({error})") from None
    places = {node.token: (node.x, node.y) for node in shapes.node}
    polygons = {each.token: each for each in shapes.polygon}
    lines = {each.token: each for each in shapes.line}
    areas: dict[str, tuple[Polygon, ...]] = {}
    strokes: dict[str, tuple[Float[np.ndarray, "_ 2"], ...]] = {}
    for name, rows in features.items():
        if name in LINES:
            tokens = [row.line_token or "" for row in rows]
            strokes[name] = _strokes(tokens, lines, places, within, tables, path)
        else:
            tokens = [t for row in rows for t in row.polygon_tokens or [row.polygon_token or ""]]
            areas[name] = _areas(tokens, polygons, places, within, tables, path)
    return LogMap(areas, strokes)


def _strokes(
    tokens: list[str],
    lines: Mapping[str, _Line],
    places: Mapping[str, tuple[float, float]],
    within: Within,
    tables: Tables,
    path: Path,
) -> tuple[Float[np.ndarray, "_ 2"], ...]:
    found: list[Float[np.ndarray, "_ 2"]] = []
    for token in tokens:
        points = None if token not in lines else _points(lines[token].node_tokens, places, 2)
        if points is None:
            tables.fault(f"{path.name}: lines point to nothing and are left out", token)
        elif _meets(points, within):
            found.append(points)
    return tuple(found)


def _areas(
    tokens: list[str],
    polygons: Mapping[str, _Polygon],
    places: Mapping[str, tuple[float, float]],
    within: Within,
    tables: Tables,
    path: Path,
) -> tuple[Polygon, ...]:
    found: list[Polygon] = []
    for token in tokens:
        shape = polygons.get(token)
        outline = None if shape is None else _points(shape.exterior_node_tokens, places, 3)
        if shape is None or outline is None:
            tables.fault(f"{path.name}: polygons point to nothing and are left out", token)
        elif _meets(outline, within):
            holes = [_points(hole.node_tokens, places, 3) for hole in shape.holes]
            found.append(Polygon(outline, tuple(hole for hole in holes if hole is not None)))
    return tuple(found)


def _points(
    tokens: list[str], places: Mapping[str, tuple[float, float]], least: int
) -> Float[np.ndarray, "_ 2"] | None:
    """Places of nodes without the last that repeats the first of a ring; None where one is not known."""
    if least == 3 and len(tokens) > 1 and tokens[0] == tokens[-1]:
        tokens = tokens[:-1]
    if len(tokens) < least or any(token not in places for token in tokens):
        return None
    return np.array([places[token] for token in tokens])


def _meets(points: Float[np.ndarray, "n 2"], within: Within) -> bool:
    return bool((points.max(axis=0) >= within[0]).all() and (points.min(axis=0) <= within[1]).all())


def _of_layers(folder: Path, within: Within) -> LogMap:
    about = of_type(read_json(folder / LAYERS_FILE), _Layers, str(folder / LAYERS_FILE))
    origin, pixel_m = np.array(about.origin_xy_of_pixel_0_0), about.resolution_m
    areas: dict[str, tuple[Polygon, ...]] = {}
    for name, layer in OF_PICTURES.items():
        file = folder / f"{name}.png"
        if file.is_file():
            areas[layer] = polygons_of(_mask(file), origin, pixel_m, within)
    return LogMap(areas)


def _of_mask(tables: Tables, log_token: str, within: Within) -> LogMap:
    """The drivable area of the picture that ``map.json`` names, whose last row lies at y = 0."""
    maps = tables.optional("map", MapRow, "maps")
    rows = {token: row for token, row in maps.items() if log_token in row.log_tokens}
    if not rows:
        return LogMap()
    if len({row.filename for row in rows.values()}) > 1:
        names = " and ".join(sorted(row.filename for row in rows.values()))
        raise InputError(f"map.json names two maps of one drive, {names}; take one away")
    given = next(iter(rows.values())).filename
    if not is_path(given):
        raise InputError(f"map.json names {given[:200]!r}, which is no file name")
    mask = _mask(tables.root / given)[::-1]
    # The last row reaches from y = 0 up; contours go through centres of pixels.
    return LogMap({"drivable_area": polygons_of(mask, np.full(2, _MASK_M / 2), _MASK_M, within)})


def _mask(path: Path) -> Bool[np.ndarray, "h w"]:
    picture = read_picture(path)
    return (picture if picture.ndim == 2 else picture[..., 0]) >= 128


def polygons_of(
    mask: Bool[np.ndarray, "h w"], origin_m: Float[np.ndarray, " 2"], pixel_m: float, within: Within
) -> tuple[Polygon, ...]:
    """Outlines of what is True, with their holes.

    ``origin_m`` is the centre of pixel (0, 0), and y grows with the rows. Outlines run along the middle of
    the outermost pixels and are simplified by at most half a pixel.
    """
    height, width = mask.shape
    first = np.clip(np.floor((within[0] - origin_m) / pixel_m), 0, (width, height)).astype(int)
    last = np.clip(np.ceil((within[1] - origin_m) / pixel_m) + 1, 0, (width, height)).astype(int)
    part = np.ascontiguousarray(mask[first[1] : last[1], first[0] : last[0]], dtype=np.uint8)
    if not part.any():
        return ()
    contours, tree = cv2.findContours(part, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    rings = [cv2.approxPolyDP(contour, 0.5, True)[:, 0] for contour in contours]
    large = [len(ring) > 2 and cv2.contourArea(ring) * pixel_m**2 >= _LEAST_M2 for ring in rings]
    world = [(ring + first) * pixel_m + origin_m for ring in rings]
    parents = tree[0, :, 3]
    return tuple(
        Polygon(world[k], tuple(world[h] for h in np.flatnonzero(parents == k) if large[h]))
        for k in np.flatnonzero(parents < 0)
        if large[k]
    )
