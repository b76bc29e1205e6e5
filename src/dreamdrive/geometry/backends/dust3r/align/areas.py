"""What the paper's loss divides by."""

from typing import Literal

import numpy as np
from jaxtyping import Float

from dreamdrive.geometry.backends.dust3r.pairmaps import PairMaps

Normalisation = Literal["pooled", "modular"]


def half_areas(maps: PairMaps, normalisation: Normalisation) -> Float[np.ndarray, "e 2"]:
    """The divisor A (E, 2) of each edge's first and second image.

    ``pooled`` is the number of pixels of all first images, or of all second images; ``modular`` the mean over
    edges of the means over pixels. They are the same where all images are of one size.
    """
    areas = np.array([[side.size for side in pair] for pair in maps.confidence], dtype=np.float64)
    if normalisation == "modular":
        return len(areas) * areas
    return np.broadcast_to(areas.sum(axis=0), areas.shape).copy()
