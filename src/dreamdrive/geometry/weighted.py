"""Weighted statistics."""

import numpy as np
from jaxtyping import Float


def weighted_median(values: Float[np.ndarray, " n"], weights: Float[np.ndarray, " n"]) -> float:
    """The lowest value with half of the weight at or below it; NaN values count as absent.

    Returns:
        The value, or NaN where nothing weighs.
    """
    counts = ~np.isnan(values) & (weights > 0)
    values, weights = values[counts], weights[counts]
    if not len(values):
        return float("nan")
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weights[order], dtype=np.float64)
    return float(values[order][np.searchsorted(below, below[-1] / 2)])
