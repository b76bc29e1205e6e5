"""The map of edition 2 from above: many grounds, worn paint, repairs, snow; coarsely far away."""

from dataclasses import dataclass
from itertools import groupby

import cv2
import numpy as np
import shapely
from jaxtyping import Float, UInt8
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from dreamdrive.scene.street.layout import Area, Layout, Line
from dreamdrive.scene.street.truth import Semantic
from streetworld.edition2.light.textures import (
    TextureKind,
    TextureLibrary,
    levelled,
    mirrored_tile,
    recoloured,
)
from streetworld.edition2.roads import marks
from streetworld.edition2.roads.sheet import Sheet
from streetworld.edition2.roads.tiles import VARIANTS, low_noise, tile
from streetworld.engine.ground import GroundMap
from streetworld.engine.paint import Image
from streetworld.engine.road import rectangle_around

_TEXEL_M, _MOST_TEXELS = 0.05, 3_500_000
_FAR_M, _FAR_TEXEL_M = 320.0, 0.5
_CUT_SHARE = 0.6  # of grounds that are cut from pictures, where there are any
_WIDTH_M = {"lane_divider": 0.14, "road_divider": 0.15, "road_edge": 0.13, "stop_line": 0.45}
_CLASS = {
    "road": Semantic.ROAD,
    "parking": Semantic.ROAD,
    "crossing": Semantic.ROAD,
    "sidewalk": Semantic.SIDEWALK,
    "grass": Semantic.GRASS,
}
_PAINTED = {
    "road": (["asphalt", "concrete", "stones", "earth"], [0.82, 0.08, 0.04, 0.06]),
    "parking": (["asphalt", "concrete", "stones", "earth"], [0.6, 0.15, 0.15, 0.1]),
    "sidewalk": (["slabs", "concrete", "asphalt", "stones", "earth"], [0.5, 0.2, 0.15, 0.1, 0.05]),
    "grass": (["grass", "earth", "asphalt", "slabs"], [0.78, 0.16, 0.03, 0.03]),
}
_WRONG: tuple[TextureKind, ...] = ("road", "ground", "facade", "vegetation", "clutter")
_CUT_KIND: dict[str, TextureKind] = {
    "road": "road",
    "parking": "road",
    "sidewalk": "ground",
    "grass": "ground",
}


@dataclass(frozen=True)
class Ground2(GroundMap):
    """The near map, the far one around it, and how wet each spot of the near one gets (0..255)."""

    far: GroundMap
    hollow: UInt8[np.ndarray, "p q"]

    def labels_at(self, points_m: Float[np.ndarray, "n 2"]) -> UInt8[np.ndarray, " n"]:
        """Class of the ground at some places."""
        x, y = self.corner_m
        width, height = self.size_m
        px, py = points_m[:, 0], points_m[:, 1]
        near = (px > x) & (px < x + width) & (py < y) & (py > y - height)
        return np.where(near, super().labels_at(points_m), self.far.labels_at(points_m))

    def wetness(self, points_m: Float[np.ndarray, "n 2"], level: float) -> Float[np.ndarray, " n"]:
        """How much water lies at some places, 0 to 1, when the street is ``level`` wet."""
        height, width = self.hollow.shape
        column = (points_m[:, 0] / 0.25).astype(np.int64) % width
        row = (points_m[:, 1] / 0.25).astype(np.int64) % height
        depth = self.hollow[row, column].astype(np.float32) / 255
        return np.clip(2.5 * (depth - 1 + level) + 0.25, 0.1, 1).astype(np.float32)


def paint_ground(
    layout: Layout, bounds_m: tuple[float, float, float, float], textures: TextureLibrary | None
) -> Ground2:
    """Draw the areas and lines of a layout inside the bounds (x0, y0, x1, y1), and coarsely around them."""
    x0, y0, x1, y1 = bounds_m
    texel = max(_TEXEL_M, float(np.sqrt((x1 - x0) * (y1 - y0) / _MOST_TEXELS)))
    covers = _Covers(layout, textures)
    near = Sheet((x0, y1), texel, (int((y1 - y0) / texel), int((x1 - x0) / texel)))
    image, label = covers.painted(near, fine=True)
    middle = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    half = max(_FAR_M, 0.5 * (x1 - x0) + 60, 0.5 * (y1 - y0) + 60)
    coarse = max(_FAR_TEXEL_M, half / _FAR_M * _FAR_TEXEL_M)
    count = int(2 * half / coarse)
    far = Sheet((middle[0] - half, middle[1] + half), coarse, (count, count))
    around = GroundMap(*covers.painted(far, fine=False), far.corner_m, coarse)
    rng = np.random.default_rng([layout.seed, 64])
    hollow = np.clip(low_noise(rng, (256, 256), {2: 40, 6: 50, 12: 50}) + 128, 0, 255).astype(np.uint8)
    return Ground2(image, label, (x0, y1), texel, around, hollow)


class _Covers:
    """What covers the ground of a layout: equal areas are covered alike on the near and the far map."""

    def __init__(self, layout: Layout, textures: TextureLibrary | None) -> None:
        self.layout, self.textures = layout, textures
        self.rng = np.random.default_rng([layout.seed, 63])
        self.tiles = {kind: self._tile(kind) for kind in _PAINTED}
        pale = self.rng.uniform(150, 245)
        self.white = np.array([pale, pale, pale * self.rng.uniform(0.9, 1.02)], np.float32)
        self.yellow = np.array([self.rng.uniform(190, 240), self.rng.uniform(140, 190), 50], np.float32)
        self.divider_yellow = self.rng.random() < 0.35
        self.edge_yellow = self.rng.random() < 0.08
        self.wear = self.rng.beta(1.2, 2.5)
        self.dash_m = [(3.0, 4.0), (3.0, 9.0), (1.5, 3.0), (6.0, 6.0), (3.0, 6.0)][int(self.rng.integers(5))]
        self.double = self.rng.random() < 0.3
        self.zebra_m = float(self.rng.choice([0.8, 1.0, 1.2]))

    def _tile(self, kind: str) -> tuple[Image, float]:
        """A tile and the side of its texels in metres."""
        rng, found = self.rng, None
        if self.textures is not None and rng.random() < _CUT_SHARE:
            cut_kind: TextureKind = _CUT_KIND[kind]
            if rng.random() < 0.06:
                cut_kind = _WRONG[int(rng.integers(len(_WRONG)))]
            found = self.textures.pick(cut_kind, self.layout.seed, rng)
        if found is not None:
            picture, about = found
            texel = about.width_m / picture.shape[1] * rng.uniform(0.7, 1.4)
            return mirrored_tile(recoloured(rng, levelled(picture, about.kind))), texel
        names, shares = _PAINTED[kind]
        name = str(rng.choice(names, p=shares))
        return recoloured(rng, tile(name, int(rng.integers(VARIANTS))), 0.7), _TEXEL_M * rng.uniform(0.6, 1.5)

    def _spread(self, kind: str, sheet: Sheet) -> Image:
        """The tile of a kind over a whole sheet, brighter and darker from place to place."""
        picture, texel = self.tiles[kind]
        scale = texel / sheet.texel_m
        size = max(4, round(picture.shape[1] * scale)), max(4, round(picture.shape[0] * scale))
        one = cv2.resize(picture, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
        times = -(-sheet.shape[0] // one.shape[0]), -(-sheet.shape[1] // one.shape[1])
        return np.tile(one, (*times, 1))[: sheet.shape[0], : sheet.shape[1]].copy()

    def painted(self, sheet: Sheet, *, fine: bool) -> tuple[Image, UInt8[np.ndarray, "h w"]]:
        """Colours and classes of a sheet."""
        rng = np.random.default_rng([self.layout.seed, 65, fine])
        image = self._spread("grass", sheet)
        label = np.full(sheet.shape, Semantic.GRASS, dtype=np.uint8)
        mask = np.zeros(sheet.shape, dtype=np.uint8)
        surfaces: dict[str, Image] = {}
        covers = [a for a in self.layout.areas if a.kind != "crossing"]
        for kind, areas in groupby(covers, lambda area: area.kind):  # later areas lie on earlier ones
            if kind not in surfaces:
                surfaces[kind] = self._spread(kind, sheet)
                if fine and kind == "road":
                    marks.repairs(rng, surfaces[kind], sheet.texel_m)
            mask[:] = 0
            for area in areas:
                sheet.fill(mask, shapely.Polygon(area.polygon, area.holes))
            label[mask > 127] = _CLASS[kind]
            cv2.copyTo(surfaces[kind], mask // 128, image)
        self._paint_lines(rng, sheet, image, label)
        self._weather(rng, sheet, image, label)
        return image, label

    def _paint_lines(self, rng: np.random.Generator, sheet: Sheet, image: Image, label: np.ndarray) -> None:
        """Lines, crossings and signs on the road, worn in places."""
        white, yellow = np.zeros(sheet.shape, np.uint8), np.zeros(sheet.shape, np.uint8)
        for area in self.layout.areas:
            if area.kind == "crossing":
                sheet.fill(white, _stripes(area, self.zebra_m))
        for line in self.layout.lines:
            yellow_line = self.divider_yellow if line.kind == "road_divider" else False
            yellow_line |= self.edge_yellow and line.kind == "road_edge"
            sheet.fill(yellow if yellow_line else white, self._outline(line))
        if sheet.texel_m < 0.2:
            marks.letters(rng, white, label, sheet, self.layout)
        worn = low_noise(rng, sheet.shape, {2: 0.2, 5: 0.25, 20: 0.35})
        speck = tile("asphalt", 3)[..., 0].astype(np.float32)
        for mask, ink in ((white, self.white), (yellow, self.yellow)):
            at = np.flatnonzero(mask)
            if not len(at):
                continue
            rows, columns = at // sheet.shape[1], at % sheet.shape[1]
            spots = (speck[rows % len(speck), columns % len(speck)] - speck.mean()) / speck.std()
            keep = np.clip(1.15 - 1.7 * self.wear + worn.ravel()[at] * 0.9 + 0.18 * spots, 0.0, 1)
            share = (mask.ravel()[at] / np.float32(255) * keep)[:, None]
            flat = image.reshape(-1, 3)
            below = flat[at].astype(np.float32)
            flat[at] = (below + share * (ink - below)).astype(np.uint8)
            on_road = label.ravel()[at] == Semantic.ROAD
            label.ravel()[at[(share[:, 0] > 0.25) & on_road]] = Semantic.MARKING

    def _outline(self, line: Line) -> BaseGeometry:
        """What a line covers: dashes, a stroke, or two."""
        path = shapely.LineString(line.points)
        pieces: list[BaseGeometry] = [path]
        if line.kind == "lane_divider":
            dash, gap = self.dash_m
            pieces = [substring(path, s, s + dash) for s in np.arange(0.0, path.length, dash + gap)]
        elif line.kind == "road_divider" and self.double:
            pieces = [path.offset_curve(0.15), path.offset_curve(-0.15)]
        half = _WIDTH_M[line.kind] / 2
        return shapely.union_all(
            [p.buffer(half, cap_style="flat", join_style="mitre") for p in pieces if p.length > 0]
        )

    def _weather(self, rng: np.random.Generator, sheet: Sheet, image: Image, label: np.ndarray) -> None:
        """Brightness that changes from place to place, and snow, in place."""
        uneven = low_noise(rng, sheet.shape, {3: 0.05, 10: 0.07, 40: 0.07})
        factor = np.clip(128 * (1 + uneven), 40, 250).astype(np.uint8)
        cv2.multiply(image, cv2.merge([factor] * 3), image, scale=1 / 128)
        snow = self.layout.light.snow
        if snow > 0:
            field = low_noise(rng, sheet.shape, {2: 0.12, 6: 0.2, 20: 0.2}) + 1.6 * snow - 0.5
            field[label != Semantic.GRASS] -= 0.45
            if sheet.texel_m < 0.2:
                field -= marks.tracks(sheet, self.layout)
            share = np.clip(3 * field, 0, 0.97)[..., None]
            white = rng.uniform(205, 245) * np.array([0.98, 1, 1.03], np.float32)
            image[:] = np.clip(image + share * (white - image), 0, 255).astype(np.uint8)
            label[(share[..., 0] > 0.7) & (label == Semantic.MARKING)] = Semantic.ROAD


def _stripes(area: Area, step_m: float) -> BaseGeometry:
    """The bars of a crossing, across its long side."""
    polygon = shapely.Polygon(area.polygon)
    corners = rectangle_around(polygon)[:4]
    edges = np.roll(corners, -1, axis=0) - corners
    long = int(np.argmax(np.linalg.norm(edges[:2], axis=1)))
    start, along, aside = corners[long], edges[long], edges[(long + 1) % 4]
    length = float(np.linalg.norm(along))
    bars = []
    for at in np.arange(0.0, length, step_m):
        a, b = start + along * at / length, start + along * min(at + 0.5 * step_m, length) / length
        bars.append(shapely.Polygon([a, b, b + aside, a + aside]))
    return shapely.union_all(bars).intersection(polygon)
