"""The optimiser of the published training and its rate: one cycle (Smith and Topin 2018)."""

from dataclasses import dataclass
from math import cos, pi

import torch
from torch import nn

from dreamdrive.errors import InputError


@dataclass(frozen=True)
class ScheduleOptions:
    """Rates of AdamW; those of the published training by default.

    Attributes:
        steps: Of the whole training; the original takes 30,001 for vehicles and 75,001 for road, with 16
            samples each.
        rate: Largest rate.
        rising: Share of the steps until then.
        start: The first rate as a share of the largest.
        end: The last rate as a share of the largest.
        weight_decay: Of all weights.
    """

    steps: int = 30_001
    rate: float = 4e-3
    rising: float = 0.3
    start: float = 0.1
    end: float = 0.01
    weight_decay: float = 1e-7

    def __post_init__(self) -> None:
        if self.steps < 1 or not 0 <= self.rising <= 1:
            raise InputError(
                f"{self.steps} steps of which {self.rising} rise; expected 1 or more and a share in [0, 1]"
            )

    def rate_at(self, step: int) -> float:
        """The rate of a step, counted from 0: up and down along half cosines."""
        peak, last = self.rising * self.steps - 1, self.steps - 1
        first, final = self.start * self.rate, self.end * self.rate
        if step <= peak:
            return _along(first, self.rate, step / peak if peak > 0 else 1.0)
        return _along(self.rate, final, (step - peak) / (last - peak))


def make_optimiser(network: nn.Module, options: ScheduleOptions) -> torch.optim.AdamW:
    """AdamW for all that learns, at the rate of the first step."""
    learned = [each for each in network.parameters() if each.requires_grad]
    return torch.optim.AdamW(learned, lr=options.rate_at(0), weight_decay=options.weight_decay, fused=True)


def set_rate(optimiser: torch.optim.Optimizer, step: int, options: ScheduleOptions) -> None:
    """Let an optimiser take the rate of a step."""
    for group in optimiser.param_groups:
        group["lr"] = options.rate_at(step)


def _along(start: float, end: float, share: float) -> float:
    return end + (start - end) / 2 * (1 + cos(pi * share))
