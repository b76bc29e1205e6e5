"""Rates, what is learned, and the averaged weights."""

from math import cos, pi

import torch
from torch import nn

from dreamdrive.street_network.encoder import Encoder
from dreamdrive.street_network.network import StreetNetwork
from dreamdrive_train.street_network.options import TrainingOptions


def freeze(encoder: Encoder, options: TrainingOptions) -> None:
    """Leave what the options name as it is."""
    for module in encoder.modules():
        if isinstance(module, nn.Conv2d) and module.groups > 1:
            module.weight.requires_grad_(options.filters)
    for part in frozen(encoder, options):
        part.requires_grad_(False)


def frozen(encoder: Encoder, options: TrainingOptions) -> list[nn.Module]:
    """The first layers of the encoder that are not learned; none by default."""
    count = options.frozen_blocks
    return [encoder.stem, *encoder.blocks[:count]] if count else []


def make_optimiser(network: StreetNetwork, options: TrainingOptions) -> torch.optim.AdamW:
    """AdamW, with decay of the weights of convolutions alone."""
    groups: list[dict[str, object]] = []
    for part, rate in ((network.encoder, options.encoder_rate), (network.decoder, 1.0)):
        learned = [each for each in part.parameters() if each.requires_grad]
        for decays in (True, False):
            chosen = [each for each in learned if (each.ndim > 1) == decays]
            decay = options.weight_decay if decays else 0.0
            if chosen:
                groups.append({"params": chosen, "weight_decay": decay, "share": rate})
    return torch.optim.AdamW(groups, lr=options.rate, betas=(0.9, 0.99), fused=True)


def set_rates(optimiser: torch.optim.Optimizer, step: int, options: TrainingOptions) -> None:
    """The rates of a step."""
    done = (step + 0.5) / options.steps
    rise = min(1.0, done / max(options.warm_up, 1e-9))
    fall = 0.5 * (1 + cos(pi * max(0.0, done - options.warm_up) / (1 - options.warm_up)))
    for group in optimiser.param_groups:
        group["lr"] = options.rate * group["share"] * rise * fall


@torch.no_grad()
def average(averaged: StreetNetwork, network: StreetNetwork, step: int, keep: float) -> None:
    """Move the averaged weights towards those of a step; early ones are forgotten sooner."""
    share = 1 - min(keep, (1 + step) / (10 + step))
    for kept, new in zip(averaged.state_dict().values(), network.state_dict().values(), strict=True):
        if kept.is_floating_point():
            kept.lerp_(new, share)
