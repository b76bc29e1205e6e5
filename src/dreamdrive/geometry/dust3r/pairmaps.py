"""What the network says about pairs of images, before anything is brought together."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class PairMaps:
    """Pointmaps of directed pairs (i, j), all in the frame of camera i: x right, y down, z forward.

    Pixels are counted as the network does: the grid is that of integers, the principal point is (W/2, H/2).
    Images may differ in size, so the sizes below hold for one entry each.

    Attributes:
        edges: Indices (E, 2) of the first and the second image.
        points: For each edge the points of its first image (H, W, 3) and of its second one (U, V, 3), in a
            unit of length that is the edge's own.
        confidence: For each edge the confidences of both, (H, W) and (U, V), at least 1. Exactly 1 weighs
            nothing: that pixel is masked out.
    """

    edges: Int[np.ndarray, "e 2"]
    points: tuple[tuple[Float[np.ndarray, "_ _ 3"], Float[np.ndarray, "_ _ 3"]], ...]
    confidence: tuple[tuple[Float[np.ndarray, "_ _"], Float[np.ndarray, "_ _"]], ...]
