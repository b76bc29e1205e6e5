"""The seeded weights that golden numbers of evaluation were made with."""

import numpy as np
import torch
from torch import Tensor


def seeded_state(shapes: dict[str, list[int]], seed: int) -> dict[str, Tensor]:
    """Weights by the rule of the README: normal, scaled by what each entry is, in the order of the keys."""
    rng = np.random.RandomState(seed)
    state: dict[str, Tensor] = {}
    for key in sorted(shapes):
        if key.endswith("num_batches_tracked"):
            continue
        shape = shapes[key]
        x = rng.standard_normal(int(np.prod(shape))).astype(np.float32).reshape(shape)
        parent, kind = key.split(".")[-2:]
        if kind == "running_var":
            x = 0.5 * np.abs(x) + 0.5
        elif kind == "running_mean":
            x = 0.1 * x
        elif x.ndim == 1:
            x = (1 + 0.1 * x) if kind == "weight" and "bn" in parent else 0.1 * x
        else:
            x = x * np.sqrt(2 / np.prod(shape[1:]))
        state[key] = torch.from_numpy(x.astype(np.float32))
    return state
