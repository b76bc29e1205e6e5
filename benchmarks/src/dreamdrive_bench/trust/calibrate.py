"""The network of trust, fitted to drawn streets."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from dreamdrive.trust import MOST, RISING, ErrorNetwork
from dreamdrive_bench.trust.looks import Looks

_LAYER, _STEPS, _BATCH, _BLOCKS = 12, 1600, 8192, 150_000
_RATE, _DECAY = 0.02, 1e-4
_FLOOR = 2e-4
"""Squared error, 37 dB, below which differences do not matter."""


def calibrated(streets: Sequence[Looks], seed: int = 0) -> ErrorNetwork:
    """The network whose squared error is most likely if errors have a gamma distribution about it.

    Its mean is then theirs: the expected PSNR of a view is not too high, as it is where roots are compared.
    """
    features = np.concatenate([s.features.reshape(-1, s.features.shape[-1]) for s in streets])
    errors = np.concatenate([s.squared_error.ravel() for s in streets])
    chosen = np.random.default_rng(seed).permutation(len(errors))[:_BLOCKS]
    mean, deviation = features.mean(axis=0), features.std(axis=0) + 1e-6
    x = torch.from_numpy(((features - mean) / deviation)[chosen]).float()
    off = torch.from_numpy(errors[chosen]).float() + _FLOOR
    generator = torch.Generator().manual_seed(seed)
    rising = torch.tensor(RISING)[:, None]
    free = {
        "weights": torch.randn(len(RISING), _LAYER, generator=generator) / 2 - rising.float(),
        "bias": torch.randn(_LAYER, generator=generator),
        "out": torch.zeros(_LAYER),
        "base": torch.tensor([-4.0]),
    }
    for value in free.values():
        value.requires_grad_(True)
    optimizer = torch.optim.Adam(free.values(), lr=_RATE)
    rate = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, _STEPS)
    for _ in range(_STEPS):
        rows = torch.randint(len(x), (_BATCH,), generator=generator)
        found = _network(free, rising)
        layer = torch.tanh(x[rows] @ found["weights"] + found["bias"])
        guess = MOST * torch.sigmoid(layer @ found["out"] + found["base"]) + _FLOOR
        loss = (off[rows] / guess + guess.log()).mean()
        small = sum((free[name].square().sum() for name in ("weights", "bias", "out")), torch.zeros(()))
        optimizer.zero_grad()
        (loss + _DECAY * small).backward()
        optimizer.step()
        rate.step()
    with torch.no_grad():
        kept = {name: value.numpy().astype(np.float32) for name, value in _network(free, rising).items()}
    return ErrorNetwork(mean=mean.astype(np.float32), deviation=deviation.astype(np.float32), **kept)


def _network(free: dict[str, Tensor], rising: Tensor) -> dict[str, Tensor]:
    """The network of free values: none that shall rise falls."""
    positive = torch.nn.functional.softplus
    weights = torch.where(rising, positive(free["weights"]), free["weights"])
    return {**free, "weights": weights, "out": positive(free["out"])}
