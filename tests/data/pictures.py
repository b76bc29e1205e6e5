"""Pictures for tests."""

import cv2
import numpy as np


def texture(height: int, width: int, seed: int = 0) -> np.ndarray:
    """A smooth random RGB picture with edges of a few pixels."""
    coarse = np.random.default_rng(seed).integers(
        0, 256, (height // 12 + 2, width // 12 + 2, 3), dtype=np.uint8
    )
    return cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
