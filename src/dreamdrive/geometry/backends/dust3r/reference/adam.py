"""The authors' optimiser of global alignment: Adam with a falling rate."""

from typing import Literal

import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.geometry.backends.dust3r.reference.objective import Objective, Raw

Schedule = Literal["cosine", "linear"]
BETAS = (0.9, 0.9)


def descend(
    objective: Objective,
    raw: Raw,
    steps: int = 300,
    *,
    schedule: Schedule = "cosine",
    of: int | None = None,
    rate: float = 0.01,
    last_rate: float = 1e-6,
) -> Float[np.ndarray, " _"]:
    """Move the parameters in place; the loss (steps,) before each step comes back.

    A step moves a parameter by about the rate at most, and the rates of 300 steps sum to 1.5: the log of a
    focal length, being a 20th of its parameter, never moves by more than 0.075.

    Args:
        objective: The loss.
        raw: Parameters, changed in place.
        steps: Number of steps.
        schedule: How the rate falls from ``rate`` to ``last_rate``.
        of: Length of the whole schedule, of which only ``steps`` are made; None is ``steps``.
        rate: First learning rate.
        last_rate: The rate that the schedule ends at.
    """
    optimiser = torch.optim.Adam(raw.tensors, lr=rate, betas=BETAS, eps=1e-8)
    losses: list[float] = []
    for step in range(steps):
        t = step / (of or steps)
        share = (1 + np.cos(np.pi * t)) / 2 if schedule == "cosine" else 1 - t
        optimiser.param_groups[0]["lr"] = float(last_rate + (rate - last_rate) * share)
        optimiser.zero_grad()
        loss = objective(raw)
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    return np.array(losses)
