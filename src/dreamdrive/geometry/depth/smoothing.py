"""Semi-global smoothing of a cost volume (Hirschmueller, 2008)."""

import numpy as np
from jaxtyping import Float

from dreamdrive import _native

STEP_COST = 0.10  # a change by one label
JUMP_COST = 0.9  # a jump, on a featureless neighbourhood
JUMP_LEVELS = 8.0  # grey levels at which the jump costs half


class CostBuffers:
    """Buffers for one cost volume: fresh memory of this size costs more than the arithmetic on it."""

    def __init__(self, height: int, labels: int, width: int) -> None:
        self.cost = np.zeros((height, labels, width), np.float32)
        self.total = np.zeros_like(self.cost)


def best_label(work: CostBuffers, grey: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
    """The label of each pixel for which paths of ``work.cost`` over four directions cost least in sum.

    It is refined by a parabola through its neighbours. Jumps are cheaper across the edges of the picture.
    """
    label = np.empty(grey.shape, np.float32)
    _native.smooth(work.cost, _jump(grey, 0), _jump(grey, 1), STEP_COST, work.total, label)
    return label


def _jump(grey: Float[np.ndarray, "h w"], axis: int) -> Float[np.ndarray, "n m"]:
    """What a jump between neighbours along an axis costs."""
    jump = np.float32(JUMP_COST) / (1 + np.abs(np.diff(grey, axis=axis)) / np.float32(JUMP_LEVELS))
    return np.maximum(jump, np.float32(STEP_COST)).astype(np.float32)
