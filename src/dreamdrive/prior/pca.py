"""Many channels of features in few: principal components over a clip."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Float16

CHANNELS = 16
"""Components that are kept unless told."""


def reduce(
    features: Sequence[Float[np.ndarray, "h w c"]], channels: int = CHANNELS
) -> Float16[np.ndarray, "f h w d"]:
    """The directions in which features vary most, over all pixels and frames of a clip, in half precision.

    The first component has variance 1, the others keep their share of it; signs are such that the largest
    entry of a direction is positive, so that the same features always give the same numbers. There are at
    most as many components as features.
    """
    if not len(features) or channels < 1:
        raise ValueError(f"cannot keep {channels} components of {len(features)} frames")
    count, width = 0, features[0].shape[-1]
    total, square = np.zeros(width), np.zeros((width, width))
    for one in features:
        flat = one.reshape(-1, width).astype(np.float64)
        count += len(flat)
        total += flat.sum(axis=0)
        square += flat.T @ flat
    mean = total / count
    spread, directions = np.linalg.eigh(square / count - np.outer(mean, mean))
    kept = directions[:, ::-1][:, :channels]
    largest = np.take_along_axis(kept, np.abs(kept).argmax(axis=0)[None], axis=0)
    kept = kept * np.where(largest < 0, -1.0, 1.0) / max(np.sqrt(max(spread[-1], 0.0)), 1e-12)
    return np.stack([((one.astype(np.float64) - mean) @ kept).astype(np.float16) for one in features])
