"""Sizes of road users by their looks."""

import numpy as np

from dreamdrive.scene.layout import BoxKind

_RANGE_M: dict[BoxKind, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "car": ((3.6, 1.66, 1.38), (4.9, 1.92, 1.75)),
    "van": ((4.6, 1.9, 1.9), (6.2, 2.1, 2.7)),
    "truck": ((6.2, 2.2, 2.7), (10.5, 2.5, 3.8)),
    "bus": ((9.0, 2.45, 2.9), (12.2, 2.55, 3.4)),
    "bicycle": ((1.7, 0.6, 1.7), (1.9, 0.66, 1.9)),
    "motorcycle": ((1.9, 0.7, 1.55), (2.3, 0.85, 1.8)),
    "pedestrian": ((1.05, 0.76, 1.15), (1.15, 0.8, 1.95)),
}


def size_of(kind: BoxKind, look: int) -> tuple[float, float, float]:
    """Length, width and height."""
    low, high = _RANGE_M[kind]
    length, width, height = np.random.default_rng([look, 21]).uniform(low, high)
    return round(float(length), 3), round(float(width), 3), round(float(height), 3)
