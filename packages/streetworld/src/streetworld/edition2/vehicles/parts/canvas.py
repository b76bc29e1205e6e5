"""A picture drawn in metres: the sides of vehicles."""

from collections.abc import Sequence
from copy import copy
from functools import lru_cache

import cv2
import numpy as np

from streetworld.edition2.layouts.variants import Colour
from streetworld.engine.paint import Image, noise

Place = tuple[float, float]
"""Metres to the right of the middle and above the ground, as seen by who looks at this side."""

_SHIFT = 4  # fractional bits of OpenCV's corners
_GRAIN_PX = 640
LETTERS = list("ABCDEFGHIKLMNOPRSTUVXYZ")


class Canvas:
    """A picture of a side, of a width and a height in metres, at most ``most_px`` texels either way."""

    def __init__(self, width_m: float, height_m: float, colour: Colour, most_px: int = 256) -> None:
        self.width_m, self.height_m = width_m, height_m
        self.per_m = most_px / max(width_m, height_m)
        shape = max(8, round(height_m * self.per_m)), max(8, round(width_m * self.per_m))
        self.image = np.full((*shape, 3), np.rint(colour), dtype=np.uint8)
        self._scale = np.array([shape[1] / width_m, -shape[0] / height_m])
        self._origin = np.array([0.5 * shape[1] - 0.5, shape[0] - 0.5])

    def mirrored(self) -> "Canvas":
        """The same seen in a mirror: the other side of a vehicle."""
        other = copy(self)
        other.image = np.ascontiguousarray(self.image[:, ::-1])
        return other

    def _texels(self, points: Sequence[Place]) -> np.ndarray:
        places = self._origin + np.asarray(points, dtype=np.float64) * self._scale
        return np.rint(places * (1 << _SHIFT)).astype(np.int32)

    def polygon(self, points: Sequence[Place], colour: Colour) -> None:
        """A filled outline."""
        cv2.fillPoly(self.image, [self._texels(points)], colour, cv2.LINE_AA, _SHIFT)

    def rectangle(self, low: Place, high: Place, colour: Colour) -> None:
        """A filled rectangle between two corners."""
        (a, b), (c, d) = low, high
        self.polygon([(a, b), (c, b), (c, d), (a, d)], colour)

    def ellipse(self, centre: Place, radii_m: Place, colour: Colour) -> None:
        """A filled ellipse."""
        turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        around = np.stack([np.cos(turn), np.sin(turn)], axis=-1) * radii_m + np.asarray(centre)
        self.polygon(list(map(tuple, around)), colour)

    def line(self, points: Sequence[Place], colour: Colour, width_m: float) -> None:
        """Strokes from point to point, no thinner than a texel."""
        thick = max(1, round(width_m * self.per_m))
        cv2.polylines(self.image, [self._texels(points)], False, colour, thick, cv2.LINE_AA, _SHIFT)

    def fade(self, points: Sequence[Place], low: Colour, high: Colour) -> None:
        """A filled outline whose colour changes from its foot to its top."""
        texels = self._texels(points)
        most = np.array(self.image.shape[1::-1]) - 1
        first = np.clip((texels.min(axis=0) >> _SHIFT) - 1, 0, most)
        last = np.clip((texels.max(axis=0) >> _SHIFT) + 2, 0, most) + 1
        band = self.image[first[1] : last[1], first[0] : last[0]]
        mask = np.zeros(band.shape[:2], dtype=np.uint8)
        cv2.fillPoly(mask, [texels - (first << _SHIFT).astype(np.int32)], (255,), cv2.LINE_AA, _SHIFT)
        share = np.linspace(1, 0, len(band), dtype=np.float32)[:, None]
        bottom, top = np.array(low, np.float32), np.array(high, np.float32)
        ink = bottom + share * (top - bottom)
        inked = np.repeat(np.rint(ink).astype(np.uint8)[:, None], band.shape[1], axis=1)
        opaque = mask.astype(np.float32) * np.float32(1 / 255)
        band[:] = cv2.blendLinear(inked, np.ascontiguousarray(band), opaque, 1 - opaque)

    def word(self, text: str, at: Place, height_m: float, colour: Colour) -> None:
        """Letters that start at a place."""
        scale = height_m * self.per_m / 22
        place = self._texels([at])[0] >> _SHIFT
        thick = max(1, round(1.8 * scale))
        origin = (int(place[0]), int(place[1]))
        cv2.putText(self.image, text, origin, cv2.FONT_HERSHEY_DUPLEX, scale, colour, thick, cv2.LINE_AA)

    def word_m(self, text: str, height_m: float) -> float:
        """Length of a word."""
        scale = height_m * self.per_m / 22
        (width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_DUPLEX, scale, max(1, round(1.8 * scale)))
        return width / self.per_m

    def worn(self, rng: np.random.Generator, dirt: float) -> Image:
        """The picture with the unevenness of real paint, and dirt (0 to 1) from below."""
        shape = self.image.shape[:2]
        left, top = rng.integers(0, _GRAIN_PX - np.array(shape[::-1]))
        grain = _grain()[:, top : top + shape[0], left : left + shape[1]]
        up = np.linspace(self.height_m, 0, shape[0], dtype=np.float32)[:, None]
        share = np.clip(
            0.75 * dirt * np.clip(1.1 - 1.6 * up / min(self.height_m, 2.0), 0.06, 1) * grain[1], 0, 0.9
        )
        kept = (1 - share) * grain[0]
        soil = np.array([116, 106, 94], np.float32)
        return cv2.convertScaleAbs(self.image * kept[..., None] + share[..., None] * soil)


@lru_cache(maxsize=1)
def _grain() -> np.ndarray:
    """Unevenness about 1 of paint and of dirt (2, H, W), of which each picture takes a piece."""
    rng, shape = np.random.default_rng(0), (_GRAIN_PX, _GRAIN_PX)
    return 1 + np.stack([noise(rng, shape, {6: 0.012, 40: 0.035}), noise(rng, shape, {8: 0.12, 30: 0.25})])


def lettering(rng: np.random.Generator, least: int = 4, most: int = 9) -> str:
    """A made-up word."""
    return "".join(rng.choice(LETTERS, int(rng.integers(least, most + 1))))
