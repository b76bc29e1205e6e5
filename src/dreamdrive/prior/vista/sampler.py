"""Euler sampling in the noise scale of EDM (Karras et al., NeurIPS 2022), as Vista does it."""

import itertools
from collections.abc import Callable
from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor

SIGMA_MAX, SIGMA_MIN, RHO = 700.0, 0.002, 7.0

Branches = tuple[Float[Tensor, "t c h w"], Float[Tensor, "t c h w"]]
"""The network's answers without and with the conditions."""
Velocity = Callable[[Float[Tensor, "t c h w"], float, Float[Tensor, " t"]], Branches]
"""From the scaled latents, the time 0.25 ln sigma and the mask of fixed frames to the network's answers."""
Schedule = Literal["constant", "triangle", "linear"]


def sigmas(steps: int) -> list[float]:
    """Noise at the start of each step, and 0 at the end: ``steps`` + 1 falling numbers."""
    first, last = SIGMA_MAX ** (1 / RHO), SIGMA_MIN ** (1 / RHO)
    share = torch.linspace(0, 1, steps, dtype=torch.float64)
    return [*((first + share * (last - first)) ** RHO).tolist(), 0.0]


def guidance(schedule: Schedule, frames: int) -> Float[Tensor, " t"]:
    """How strongly the conditions count in each frame of a round.

    ``constant`` is Vista's for a single round, ``triangle`` for several, ``linear`` SVD's.
    """
    if schedule == "constant":
        return torch.full((frames,), 2.5)
    if schedule == "linear":
        return torch.linspace(1.0, 3.0, frames)
    place = torch.linspace(0, 1, frames)
    return 1.0 + 1.5 * (1 - (2 * place - 1).abs())


def time_of(sigma: float) -> float:
    """What the network is told of the noise."""
    return 0.25 * float(torch.log(torch.tensor(sigma, dtype=torch.float64)))


def denoise(
    velocity: Velocity,
    latents: Float[Tensor, "t c h w"],
    sigma: float,
    scale: Float[Tensor, " t"],
    mask: Float[Tensor, " t"],
) -> Float[Tensor, "t c h w"]:
    """The clean latents that the network sees in noisy ones (v-prediction).

    ``sigma`` is the standard deviation of their noise, ``scale`` the guidance of each frame, and ``mask`` one
    for fixed frames.
    """
    without, given = velocity(latents / (sigma**2 + 1) ** 0.5, time_of(sigma), mask)
    strength = scale.to(latents)[:, None, None, None]
    answer = (without + strength * (given - without)).to(latents.dtype)
    return latents / (sigma**2 + 1) - sigma / (sigma**2 + 1) ** 0.5 * answer


def sample(
    velocity: Velocity,
    noise: Float[Tensor, "t c h w"],
    scale: Float[Tensor, " t"],
    mask: Float[Tensor, " t"],
    known: Float[Tensor, "t c h w"],
    steps: int,
    tell: Callable[[], None] = lambda: None,
) -> Float[Tensor, "t c h w"]:
    """Latents of one round from noise of standard deviation 1, by Euler's rule; ``scale`` guides each frame.

    Of frames whose ``mask`` is one the clean latents are ``known``. They are put in their places before each
    step and after the last: without noise, as in Vista's training. ``tell`` is called after each step.
    """
    levels = sigmas(steps)
    fixed = mask[:, None, None, None] > 0
    latents = noise * (levels[0] ** 2 + 1) ** 0.5
    for sigma, following in itertools.pairwise(levels):
        latents = torch.where(fixed, known, latents)
        clean = denoise(velocity, latents, sigma, scale, mask)
        latents = latents + (following - sigma) * (latents - clean) / sigma
        tell()
    return torch.where(fixed, known, latents)
