"""Losses of a Cross-View Transformer (as its published program; focal: Lin et al. 2017, equation 4)."""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional

from dreamdrive.tasks.perception.network.network import BevPrediction
from dreamdrive.tasks.perception.training.batch import BevTruth


@dataclass(frozen=True)
class LossOptions:
    """Weights of the parts of the loss; the published ones by default."""

    vehicle: float = 1.0
    centre: float = 0.1
    road: float = 1.0
    road_entropy: float = 0.1
    """Of the plain cross entropy of road, beside its focal loss."""
    gamma: float = 2.0
    """How much less a cell counts that is answered well."""
    alpha: float = -1.0
    """Weight of cells with a vehicle, of others 1 - alpha, all doubled; below 0, as published, none."""
    visibility: int = 2
    """Least visibility of vehicles whose cells count."""
    empty_is_nan: bool = False
    """Whether the loss is NaN where no cell counts, as in the original; else it is 0 and teaches nothing."""


def focal_loss(
    logits: Float[Tensor, "*cells"], target: Float[Tensor, "*cells"], gamma: float = 2.0, alpha: float = -1.0
) -> Float[Tensor, "*cells"]:
    """Cross entropy, less of it where the answer is right: (1 - p_t)^gamma times.

    Args:
        logits: Of the probability of 1.
        target: In [0, 1]; between the two p_t is linear.
        gamma: 0 leaves cross entropy.
        alpha: Weight of ones, of zeros 1 - alpha; below 0 there are no weights.
    """
    entropy = functional.binary_cross_entropy_with_logits(logits, target, reduction="none")
    p = torch.sigmoid(logits)
    wrong = p + target - 2 * p * target
    loss = entropy * wrong**gamma
    return loss if alpha < 0 else loss * (alpha * target + (1 - alpha) * (1 - target))


def bev_losses(
    said: BevPrediction, truth: BevTruth, options: LossOptions = LossOptions()
) -> dict[str, Float[Tensor, ""]]:
    """The parts of the loss of what is segmented, already weighted; means over the cells that count."""
    parts: dict[str, Tensor] = {}
    counts = truth.visibility >= options.visibility
    if said.vehicle is not None and said.centre is not None:
        scale = 2 if options.alpha >= 0 else 1  # so that 0.5 is no weights
        vehicle = scale * focal_loss(said.vehicle, truth.vehicle.float(), options.gamma, options.alpha)
        centre = focal_loss(said.centre, truth.centre, options.gamma)
        parts["vehicle"] = options.vehicle * _mean(vehicle, counts, options.empty_is_nan)
        parts["centre"] = options.centre * _mean(centre, counts, options.empty_is_nan)
    if said.road is not None:
        target = truth.road.float()
        entropy = functional.binary_cross_entropy_with_logits(said.road, target)
        parts["road"] = options.road * focal_loss(said.road, target, options.gamma).mean()
        parts["road_entropy"] = options.road_entropy * entropy
    return parts


def _mean(
    loss: Float[Tensor, "*cells"], counts: Bool[Tensor, "*cells"], empty_is_nan: bool
) -> Float[Tensor, ""]:
    total, count = torch.where(counts, loss, 0).sum(), counts.sum()
    return total / (count if empty_is_nan else count.clamp(min=1))
