"""The similarity that best brings points onto points."""

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.similarity import Similarity

_TINY = 1e-12


def register(
    source: Float[np.ndarray, "*n 3"],
    target: Float[np.ndarray, "*n 3"],
    weights: Float[np.ndarray, "*n"],
    *,
    robust_steps: int = 0,
) -> Similarity:
    """Minimise sum w |s R x + t - y|^2 over points x and y (Umeyama 1991, weighted), in float64; w >= 0.

    In each robust step a point weighs w / |s R x + t - y|; their limit minimises sum w |s R x + t - y|.

    Raises:
        ValueError: Fewer than three points weigh anything.
    """
    counts = weights > 0
    if np.count_nonzero(counts) < 3:
        raise ValueError(
            f"registration: {np.count_nonzero(counts)} weighted points; a similarity takes three"
        )
    x, y = source[counts].astype(np.float64), target[counts].astype(np.float64)
    trust = weights[counts].astype(np.float64)
    found = _umeyama(x, y, trust)
    for _ in range(robust_steps):
        distance = np.linalg.norm(found(x) - y, axis=1)
        floor = max(1e-3 * float(np.median(distance)), _TINY)
        found = _umeyama(x, y, trust / np.maximum(distance, floor))
    return found


def _umeyama(
    x: Float[np.ndarray, "n 3"], y: Float[np.ndarray, "n 3"], weights: Float[np.ndarray, " n"]
) -> Similarity:
    share = (weights / weights.sum())[:, None]
    middle, target = (share * x).sum(axis=0), (share * y).sum(axis=0)
    x, y = x - middle, y - target
    left, singular, right = np.linalg.svd((share * y).T @ x)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = (left * signs) @ right
    scale = float((singular * signs).sum() / max(float((share * x * x).sum()), _TINY))
    return Similarity(scale, rotation, target - scale * rotation @ middle)
