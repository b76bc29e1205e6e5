"""Retrieval by a score: how well it tells what is true from what is not."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float


@dataclass(frozen=True)
class Retrieval:
    """Figures in [0, 1] of a yes-or-no question about many things; None where one has no meaning.

    Attributes:
        true: How many of them are true.
        count: How many were judged.
        iou: Both true and found, over either; None when nothing is true or found.
        precision: True among the found; None when nothing is found.
        recall: Found among the true; None when nothing is true.
        average_precision: Mean precision over the recall, at all thresholds; None when nothing is true.
    """

    true: int
    count: int
    iou: float | None
    precision: float | None
    recall: float | None
    average_precision: float | None


def retrieval(
    true: Bool[np.ndarray, "*n"], score: Float[np.ndarray, "*n"], threshold: float = 0.5
) -> Retrieval:
    """Compare a score with the truth; from the threshold on something counts as found.

    The average precision takes all thresholds.
    """
    wanted, found = true.ravel(), score.ravel() >= threshold
    both, either = int((wanted & found).sum()), int((wanted | found).sum())
    return Retrieval(
        true=int(wanted.sum()),
        count=wanted.size,
        iou=_ratio(both, either),
        precision=_ratio(both, int(found.sum())),
        recall=_ratio(both, int(wanted.sum())),
        average_precision=_average_precision(wanted, score.ravel()),
    )


def _ratio(part: int, whole: int) -> float | None:
    return part / whole if whole else None


def _average_precision(true: np.ndarray, score: np.ndarray) -> float | None:
    """Sum of precision times the gain of recall, from the highest score down; equal scores come at once."""
    if not true.any():
        return None
    order = np.argsort(-score, kind="stable")
    last = np.flatnonzero(np.diff(score[order], append=-np.inf))
    hits = np.cumsum(true[order])[last]
    gain = np.diff(hits, prepend=0) / true.sum()
    return float((gain * hits / (last + 1)).sum())
