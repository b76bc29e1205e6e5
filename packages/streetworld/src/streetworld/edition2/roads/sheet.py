"""A picture of part of the map, to be drawn on."""

from dataclasses import dataclass

import cv2
import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

SHIFT = 4
"""Fractional bits of OpenCV's drawing."""


@dataclass(frozen=True)
class Sheet:
    """Where the map lies on a picture."""

    corner_m: tuple[float, float]
    texel_m: float
    shape: tuple[int, int]

    def pixels(self, points: object) -> np.ndarray:
        """Places as OpenCV draws them, in fractions of a texel."""
        at = (np.asarray(points, dtype=np.float64) - self.corner_m) / self.texel_m * [1, -1] - 0.5
        return np.clip(np.rint(at * (1 << SHIFT)), -(2**24), 2**24).astype(np.int32)

    def fill(self, mask: np.ndarray, geometry: BaseGeometry, value: int = 255) -> None:
        """Draw a polygon or several, in place."""
        for part in shapely.get_parts(geometry):
            if isinstance(part, shapely.Polygon) and not part.is_empty:
                rings = [self.pixels(ring.coords) for ring in (part.exterior, *part.interiors)]
                cv2.fillPoly(mask, rings, (value,), cv2.LINE_AA, SHIFT)
