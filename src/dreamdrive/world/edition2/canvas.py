"""A picture drawn in metres: the sides of vehicles."""

from collections.abc import Sequence
from copy import copy

import cv2
import numpy as np

from dreamdrive.world.edition2.draw import Colour
from dreamdrive.world.paint import Image, finished, noise

Place = tuple[float, float]
"""Metres to the right of the middle and above the ground, as seen by who looks at this side."""

_SHIFT = 4  # fractional bits of OpenCV's corners
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
        mask = np.zeros(self.image.shape[:2], dtype=np.uint8)
        cv2.fillPoly(mask, [self._texels(points)], (255,), cv2.LINE_AA, _SHIFT)
        rows = np.flatnonzero(mask.any(axis=1))
        if not len(rows):
            return
        first, last = int(rows[0]), int(rows[-1]) + 1
        share = np.linspace(1, 0, last - first, dtype=np.float32)[:, None, None]
        ink = np.array(low, np.float32) * (1 - share) + np.array(high, np.float32) * share
        band = self.image[first:last].astype(np.float32)
        opaque = mask[first:last, :, None] / np.float32(255)
        self.image[first:last] = np.rint(band + opaque * (ink - band)).astype(np.uint8)

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
        image = self.image.astype(np.float32)
        shape = image.shape[:2]
        image *= 1 + noise(rng, shape, {6: 0.012, 40: 0.035})[..., None]
        up = np.linspace(self.height_m, 0, shape[0], dtype=np.float32)[:, None]
        share = dirt * np.clip(1.1 - 1.6 * up / min(self.height_m, 2.0), 0.06, 1)
        share = share * (1 + noise(rng, shape, {8: 0.12, 30: 0.25}))
        image += np.clip(0.75 * share, 0, 0.9)[..., None] * (np.array([116, 106, 94], np.float32) - image)
        return finished(image)


def lettering(rng: np.random.Generator, least: int = 4, most: int = 9) -> str:
    """A made-up word."""
    return "".join(rng.choice(LETTERS, int(rng.integers(least, most + 1))))
