"""The map as a picture from above: asphalt, slabs, grass and paint, and the class of every spot."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import shapely
from jaxtyping import Float
from shapely.ops import substring

from dreamdrive.scene.street.layout import Area, Layout, Line
from dreamdrive.scene.street.truth import Semantic
from streetworld.engine.ground import GroundMap
from streetworld.engine.paint import finished, noise
from streetworld.engine.road import rectangle_around

_TEXEL_M = 0.06
_MOST_TEXELS = 8_000_000
_SHIFT = 4  # fractional bits of OpenCV's drawing
_WIDTH_M = {"lane_divider": 0.14, "road_divider": 0.16, "road_edge": 0.12, "stop_line": 0.4}
_DASH_M, _GAP_M = 3.0, 4.0
_ZEBRA_M = 1.0
_CLASS = {
    "road": Semantic.ROAD,
    "parking": Semantic.ROAD,
    "crossing": Semantic.MARKING,
    "sidewalk": Semantic.SIDEWALK,
    "grass": Semantic.GRASS,
}
_PAINT = np.array([226, 226, 220], np.float32)


def paint_ground(layout: Layout, bounds_m: tuple[float, float, float, float]) -> GroundMap:
    """Draw the areas and lines of a layout inside the bounds (x0, y0, x1, y1)."""
    x0, y0, x1, y1 = bounds_m
    texel = max(_TEXEL_M, float(np.sqrt((x1 - x0) * (y1 - y0) / _MOST_TEXELS)))
    shape = int((y1 - y0) / texel), int((x1 - x0) / texel)
    sheet = _Sheet((x0, y1), texel, shape)
    rng = np.random.default_rng([layout.seed, 1])
    uneven = 1 + noise(rng, shape, {2: 0.08, 9: 0.1, 60: 0.12})
    image = np.array([88, 104, 62], np.float32) * uneven[..., None]
    label = np.full(shape, Semantic.GRASS, dtype=np.uint8)
    asphalt, slabs = _asphalt(rng, shape, texel), _slabs(rng, shape, texel)
    wear = np.clip(0.85 + noise(rng, shape, {2: 0.1, 10: 0.1, 60: 0.1}), 0, 1)
    for area in layout.areas:
        cover = sheet.area(area)
        label[cover >= 0.5] = _CLASS[area.kind]
        if area.kind == "crossing":
            stripes = sheet.stripes(area, cover)
            label[(cover >= 0.5) & (stripes < 0.5)] = Semantic.ROAD
            _lay(image, stripes * wear, _PAINT)
        elif area.kind != "grass":
            _lay(image, cover, slabs if area.kind == "sidewalk" else asphalt)
    for line in layout.lines:
        cover = sheet.line(line)
        label[cover >= 0.5] = Semantic.MARKING
        _lay(image, cover * wear, _PAINT)
    return GroundMap(finished(image), label, (x0, y1), texel)


def _lay(image: np.ndarray, cover: np.ndarray, colour: np.ndarray) -> None:
    """Put a colour on part of an image, in place, where there is any of it."""
    rows, columns = np.flatnonzero(cover.any(axis=1)), np.flatnonzero(cover.any(axis=0))
    if len(rows) == 0:
        return
    window = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    region = image[window]
    region += cover[window][..., None] * ((colour if colour.ndim == 1 else colour[window]) - region)


@dataclass(frozen=True)
class _Sheet:
    """Where the map lies on the picture."""

    corner_m: tuple[float, float]
    texel_m: float
    shape: tuple[int, int]

    def pixels(self, points: list[tuple[float, float]] | np.ndarray) -> np.ndarray:
        """Places as OpenCV draws them, in fractions of a texel."""
        at = (np.asarray(points, dtype=np.float64) - self.corner_m) / self.texel_m * [1, -1] - 0.5
        return np.rint(at * (1 << _SHIFT)).astype(np.int32)

    def area(self, area: Area) -> Float[np.ndarray, "h w"]:
        """Share of every texel that a polygon covers."""
        return self._cover([[area.polygon, *area.holes]])

    def line(self, line: Line) -> Float[np.ndarray, "h w"]:
        """Share of every texel that a painted line covers."""
        path = shapely.LineString(line.points)
        pieces = [path]
        if line.kind == "lane_divider":
            starts = np.arange(0.0, path.length, _DASH_M + _GAP_M)
            pieces = [substring(path, s, s + _DASH_M) for s in starts]
        half = _WIDTH_M[line.kind] / 2
        outlines = [p.buffer(half, cap_style="flat", join_style="mitre") for p in pieces if p.length > 0]
        parts = [part for outline in outlines for part in shapely.get_parts(outline)]
        return self._cover([[np.array(part.exterior.coords)] for part in parts])

    def _cover(
        self, polygons: Sequence[Sequence[list[tuple[float, float]] | np.ndarray]]
    ) -> Float[np.ndarray, "h w"]:
        """Share of every texel that polygons cover; rings after the first are holes."""
        mask = np.zeros(self.shape, dtype=np.uint8)
        for rings in polygons:
            cv2.fillPoly(mask, [self.pixels(ring) for ring in rings], (255,), cv2.LINE_AA, _SHIFT)
        return mask.astype(np.float32) / 255

    def stripes(self, area: Area, cover: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
        """Of what a crossing covers, bars across its long side."""
        corners = rectangle_around(shapely.Polygon(area.polygon))
        edges = np.diff(corners, axis=0)[:2]
        long = int(np.argmax(np.linalg.norm(edges, axis=1)))
        along = edges[long] / np.linalg.norm(edges[long])
        rows, columns = np.nonzero(cover)
        x = self.corner_m[0] + (columns + 0.5) * self.texel_m - corners[long, 0]
        y = self.corner_m[1] - (rows + 0.5) * self.texel_m - corners[long, 1]
        striped = cover.copy()
        striped[rows, columns] *= (x * along[0] + y * along[1]) % _ZEBRA_M < _ZEBRA_M / 2
        return striped


def _asphalt(rng: np.random.Generator, shape: tuple[int, int], texel_m: float) -> np.ndarray:
    image = (rng.uniform(78, 108) + noise(rng, shape, {1: 4, 3: 6, 12: 6, 50: 6, 200: 6}))[..., None]
    image = np.repeat(image, 3, axis=-1) * np.array([1, 1, 1.03], np.float32)
    spots = round(shape[0] * shape[1] * texel_m**2 / 40)
    for _ in range(spots):
        _patch(rng, image, texel_m)
    for _ in range(2 * spots):
        _crack(rng, image)
    for _ in range(spots // 2):
        _manhole(rng, image, texel_m)
    return image


def _patch(rng: np.random.Generator, image: np.ndarray, texel_m: float) -> None:
    """A repaired rectangle, darker or lighter, with a sealed seam."""
    height, width = (rng.uniform(0.5, 3.0, 2) / texel_m).astype(int)
    top, left = (int(rng.integers(0, max(1, image.shape[i] - s))) for i, s in ((0, height), (1, width)))
    image[top : top + height, left : left + width] += rng.uniform(-22, 16)
    shade = float(rng.uniform(44, 70))
    cv2.rectangle(image, (left, top), (left + int(width), top + int(height)), (shade, shade, shade), 1)


def _crack(rng: np.random.Generator, image: np.ndarray) -> None:
    start = rng.uniform((0, 0), (image.shape[1], image.shape[0]))
    heading = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.normal(0, 0.5, 24))
    path = start + np.cumsum(np.stack([np.cos(heading), np.sin(heading)], -1) * rng.uniform(1, 4), axis=0)
    shade = float(rng.uniform(40, 62))
    cv2.polylines(image, [path.astype(np.int32)], False, (shade, shade, shade), 1, cv2.LINE_AA)


def _manhole(rng: np.random.Generator, image: np.ndarray, texel_m: float) -> None:
    centre = (int(rng.integers(0, image.shape[1])), int(rng.integers(0, image.shape[0])))
    radius = max(2, round(0.35 / texel_m))
    cv2.circle(image, centre, radius, (58, 56, 54), -1, cv2.LINE_AA)
    cv2.circle(image, centre, radius, (128, 124, 118), 1, cv2.LINE_AA)


def _slabs(rng: np.random.Generator, shape: tuple[int, int], texel_m: float) -> np.ndarray:
    """Paving of uneven brightness with dark joints."""
    slab = max(4, round(0.6 / texel_m))
    tiles = rng.normal(0, 9, (shape[0] // slab + 1, shape[1] // slab + 1)).astype(np.float32)
    grey = np.kron(tiles, np.ones((slab, slab), np.float32))[: shape[0], : shape[1]]
    grey = grey + noise(rng, shape, {1: 4, 5: 6, 30: 7})
    grey[::slab] -= 34
    grey[:, ::slab] -= 34
    return grey[..., None] + np.array(rng.uniform(130, 165) + np.array([4, 0, -8]), np.float32)
