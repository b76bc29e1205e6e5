"""The ground of a street as a picture from above."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8

from streetworld.engine.paint import Image


@dataclass(frozen=True)
class GroundMap:
    """A rectangle of the map seen from above, north up: its colours, and the ``Semantic`` of every texel.

    ``corner_m`` is x and y of its upper left corner.
    """

    image: Image
    label: UInt8[np.ndarray, "h w"]
    corner_m: tuple[float, float]
    texel_m: float

    @property
    def size_m(self) -> tuple[float, float]:
        """Extent along x and y."""
        return self.image.shape[1] * self.texel_m, self.image.shape[0] * self.texel_m

    def labels_at(self, points_m: Float[np.ndarray, "n 2"]) -> UInt8[np.ndarray, " n"]:
        """Class of the ground at some places; beyond the edge that of the edge."""
        column = ((points_m[:, 0] - self.corner_m[0]) / self.texel_m).astype(np.int64)
        row = ((self.corner_m[1] - points_m[:, 1]) / self.texel_m).astype(np.int64)
        height, width = self.label.shape
        return self.label[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
