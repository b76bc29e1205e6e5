"""How far the recorded views of a scene are off their frames."""

import numpy as np
from jaxtyping import Float, Float16, UInt8

BLOCK_PX = 8
"""Side of the blocks of pixels that residuals are of; what is left over at the right and below has none."""


def residual_of(
    shown: Float[np.ndarray, "h w 3"], frame: UInt8[np.ndarray, "h w 3"]
) -> Float16[np.ndarray, "bh bw"]:
    """Root mean square error of each block over all three colours in [0, 1]."""
    squared = np.square(shown - frame.astype(np.float32) / 255).mean(axis=-1)
    return np.sqrt(blocks(squared)).astype(np.float16)


def blocks(values: Float[np.ndarray, "h w *c"]) -> Float[np.ndarray, "bh bw *c"]:
    """Means of the blocks."""
    high, wide = values.shape[0] // BLOCK_PX, values.shape[1] // BLOCK_PX
    whole = values[: high * BLOCK_PX, : wide * BLOCK_PX]
    return whole.reshape(high, BLOCK_PX, wide, BLOCK_PX, *values.shape[2:]).mean(axis=(1, 3))
