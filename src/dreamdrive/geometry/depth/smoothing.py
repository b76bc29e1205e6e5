"""Semi-global smoothing of a cost volume (Hirschmueller, 2008)."""

import cv2
import numpy as np
from jaxtyping import Float

_P1 = 0.10  # a change by one label
_P2 = 0.9  # a jump, on a featureless neighbourhood
_P2_GRADIENT = 8.0  # grey levels at which the jump costs half


class Workspace:
    """Buffers for one cost volume: fresh memory of this size costs more than the arithmetic on it."""

    def __init__(self, height: int, labels: int, width: int) -> None:
        self.cost = np.zeros((height, labels, width), np.float32)
        self.total = np.zeros_like(self.cost)
        self.turned_cost = np.zeros((width, labels, height), np.float32)
        self.turned_total = np.zeros_like(self.turned_cost)


def semi_global(work: Workspace, grey: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h labels w"]:
    """Sum of the path costs of ``work.cost`` over four directions, float32, in ``work.total``.

    Jumps are cheaper across the edges of the picture.
    """
    for label in range(work.cost.shape[1]):
        work.turned_cost[:, label] = cv2.transpose(np.ascontiguousarray(work.cost[:, label]))
    _both_ways(work.cost, grey, work.total)
    _both_ways(work.turned_cost, np.ascontiguousarray(grey.T), work.turned_total)
    for label in range(work.cost.shape[1]):
        work.total[:, label] += cv2.transpose(np.ascontiguousarray(work.turned_total[:, label]))
    return work.total


def _both_ways(
    cost: Float[np.ndarray, "n labels m"],
    grey: Float[np.ndarray, "n m"],
    total: Float[np.ndarray, "n labels m"],
) -> None:
    """Path costs down and up the first axis, added, into ``total``."""
    jump = np.float32(_P2) / (1 + np.abs(np.diff(grey, axis=0)) / np.float32(_P2_GRADIENT))
    jump = np.maximum(jump, np.float32(_P1)).astype(np.float32)
    total[0] = path = cost[0].copy()
    for i in range(1, len(cost)):
        path = _step(path, cost[i], jump[i - 1])
        total[i] = path
    path = cost[-1].copy()
    total[-1] += path
    for i in range(len(cost) - 2, -1, -1):
        path = _step(path, cost[i], jump[i])
        total[i] += path


def _step(
    path: Float[np.ndarray, "labels m"], cost: Float[np.ndarray, "labels m"], jump: Float[np.ndarray, " m"]
) -> Float[np.ndarray, "labels m"]:
    """One pixel along all paths: stay, change by one label, or jump."""
    least = path.min(axis=0)
    reached = np.minimum(path, least + jump)
    beside = path + np.float32(_P1)
    np.minimum(reached[1:], beside[:-1], out=reached[1:])
    np.minimum(reached[:-1], beside[1:], out=reached[:-1])
    reached += cost
    reached -= least
    return reached


def best_label(total: Float[np.ndarray, "h labels w"]) -> Float[np.ndarray, "h w"]:
    """The cheapest label of each pixel (H, W), refined by a parabola through its neighbours."""
    labels = total.shape[1]
    index = total.argmin(axis=1)
    inner = np.clip(index, 1, labels - 2)[:, None]
    low, mid, high = (np.take_along_axis(total, inner + k, axis=1)[:, 0] for k in (-1, 0, 1))
    curvature = low - 2 * mid + high
    shift = np.where(curvature > 1e-6, (low - high) / np.maximum(2 * curvature, 1e-6), 0)
    refined = index + np.clip(shift, -0.5, 0.5)
    return np.where((index > 0) & (index < labels - 1), refined, index).astype(np.float32)
