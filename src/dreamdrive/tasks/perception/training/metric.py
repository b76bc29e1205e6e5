"""Intersection over union of segmented streets, of counts over all samples together."""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.tasks.perception.network.network import BevPrediction
from dreamdrive.tasks.perception.training.batch import BevTruth

THRESHOLDS = (0.4, 0.5)
"""Least probabilities that count as yes; published figures are those of 0.5."""
VISIBLE = 2
"""Least visibility of vehicles whose cells count: 40 % of them are seen."""
_GUARD = 1e-7


@dataclass(frozen=True)
class IouCounts:
    """Cells that were right and wrong, at each threshold; counts of batches add up with ``+``.

    Attributes:
        thresholds: Least probabilities that count as yes.
        hits: Cells that are answered with yes and are.
        false_alarms: Cells that are answered with yes and are not.
        misses: Cells that are answered with no and are.
        samples: How many streets were counted.
    """

    thresholds: tuple[float, ...]
    hits: tuple[int, ...]
    false_alarms: tuple[int, ...]
    misses: tuple[int, ...]
    samples: int

    def __add__(self, other: "IouCounts") -> "IouCounts":
        if self.thresholds != other.thresholds:
            raise InputError(
                f"counts at thresholds {self.thresholds} and {other.thresholds} do not add up; count both at "
                "the same ones"
            )
        sums = (
            tuple(a + b for a, b in zip(getattr(self, name), getattr(other, name), strict=True))
            for name in ("hits", "false_alarms", "misses")
        )
        return IouCounts(self.thresholds, *sums, samples=self.samples + other.samples)

    def iou(self) -> dict[float, float]:
        """Intersection over union by threshold, in [0, 1]; 0 where there is nothing to find or found."""
        rows = zip(self.thresholds, self.hits, self.false_alarms, self.misses, strict=True)
        return {threshold: hit / (hit + alarm + miss + _GUARD) for threshold, hit, alarm, miss in rows}


def iou_counts(
    logits: Float[Tensor, "b rows columns"],
    truth: UInt8[Tensor, "b rows columns"],
    counts: Bool[Tensor, "b rows columns"] | None = None,
    thresholds: tuple[float, ...] = THRESHOLDS,
) -> IouCounts:
    """Count cells of a batch; of those that ``counts`` leaves out neither answer nor truth matters."""
    kept = torch.ones_like(truth, dtype=torch.bool) if counts is None else counts
    is_there, chance = truth[kept].bool(), torch.sigmoid(logits.detach().float())[kept]
    answers = [chance >= threshold for threshold in thresholds]
    return IouCounts(
        thresholds,
        hits=tuple(int((yes & is_there).sum()) for yes in answers),
        false_alarms=tuple(int((yes & ~is_there).sum()) for yes in answers),
        misses=tuple(int((~yes & is_there).sum()) for yes in answers),
        samples=len(truth),
    )


def bev_counts(said: BevPrediction, truth: BevTruth) -> dict[str, IouCounts]:
    """Counts of a batch: ``vehicle`` where visible, as published, ``vehicle_all`` everywhere, ``road``."""
    found: dict[str, IouCounts] = {}
    if said.vehicle is not None:
        found["vehicle"] = iou_counts(said.vehicle, truth.vehicle, truth.visibility >= VISIBLE)
        found["vehicle_all"] = iou_counts(said.vehicle, truth.vehicle)
    if said.road is not None:
        found["road"] = iou_counts(said.road, truth.road)
    return found
