"""Noise levels, guidance and Euler's rule against the public code."""

from pathlib import Path

import pytest
import torch
from torch import Tensor

from dreamdrive.prior.vista.engine import Engine, RoundConditions
from dreamdrive.prior.vista.kinds import VISTA
from dreamdrive.prior.vista.sampler import (
    Branches,
    Schedule,
    Velocity,
    denoise,
    guidance,
    sample,
    sigmas,
)
from dreamdrive.prior.vista.stored import StoredModel
from tests.golden.reading import Table, cases, close, tensors
from tests.prior.vista.networks import Given, golden_unet, unet_config

NAMES: dict[str, Schedule] = {"VanillaCFG": "constant", "TrianglePredictionGuider": "triangle"}
LIMIT = 2e-5
"""Of the largest value: float32 through a run's steps, the first of which is at a noise of 700."""
TINY_STEPS = 4
"""Of the runs with the tiny UNet, which no entry tells."""


@pytest.mark.parametrize("steps", cases("vista/sampler.safetensors", r"sigmas_(\d+)"))
def test_golden_noise_levels(steps: str) -> None:
    expected = tensors("vista/sampler.safetensors")[f"sigmas_{steps}"]
    # Each of its own size: a seventh power, in which float32 rounds to 4e-6.
    torch.testing.assert_close(torch.tensor(sigmas(int(steps))), expected, atol=0, rtol=1e-5)


@pytest.mark.parametrize("name", cases("vista/sampler.safetensors", r"(\w+_scale_\d+)"))
def test_golden_guidance(name: str) -> None:
    schedule, _, frames = name.split("_")
    expected = tensors("vista/sampler.safetensors")[name][0]
    scale = guidance(schedule, int(frames))  # type: ignore[arg-type]
    if schedule == "linear":
        # The public ramp ends elsewhere, at what nothing uses; that of SVD ends at 3.
        scale = 1 + (scale - 1) * (expected[-1] - 1) / 2
    torch.testing.assert_close(scale, expected)


@pytest.mark.parametrize("name", cases("vista/sampler.safetensors", r"(\w+\.\w+)\.out"))
def test_golden_runs_with_a_linear_network(name: str) -> None:
    given = tensors("vista/sampler.safetensors")
    guider, known = name.split(".")
    frames = len(given["noise"])
    entered: list[Tensor] = []

    def velocity(x: Tensor, time: float, fixed: Tensor) -> Branches:
        plain = torch.einsum("oc,bchw->bohw", given["lin_A"], x) + 0.05 * time
        plain = plain + 0.1 * fixed[:, None, None, None]
        entered.append(x)
        return plain, plain + 0.2 * given["ctx"][:, :, None, None]

    scale = guidance(NAMES[guider], frames) if guider in NAMES else given[f"linear_scale_{frames}"].flatten()
    wanted = given[f"{name}.x_in"]
    mask = mask_of(known, frames)
    made = sample(velocity, given["noise"], scale, mask, given["cond_frame"], len(wanted))
    close(made, given[f"{name}.out"], LIMIT)
    for x, sigma, expected in zip(entered, sigmas(len(wanted)), wanted, strict=False):
        close(x * (sigma**2 + 1) ** 0.5, expected, LIMIT)


def mask_of(known: str, frames: int) -> Tensor:
    """Fixed frames of a name: ``none``, ``c0``, ``c012``."""
    mask = torch.zeros(frames)
    mask[[int(digit) for digit in known if digit.isdigit()]] = 1
    return mask


class Held(Engine):
    """The golden UNet where a stored model would be."""

    def __init__(self, vector: Tensor) -> None:
        unet = golden_unet()
        unet.add_time_proj = Given(vector)  # type: ignore[assignment]
        super().__init__(StoredModel(Path("golden"), VISTA, {}), torch.device("cpu"))
        self._held = "unet", unet


def tiny_velocity(given: Table) -> Velocity:
    """What the engine makes of a round's conditions."""
    context, image = given["crossattn"][0, 0], unet_config()["context_dim"]
    return Held(given["vector"][0]).velocity(
        RoundConditions(context[:image], given["concat"][0], context[image:])
    )


TINY = "vista/sampler_tiny_unet.safetensors"


@pytest.mark.parametrize("sigma", cases(TINY, r"denoise_sigma([\d.]+)_in"))
def test_golden_engine_denoises_with_a_tiny_unet(sigma: str) -> None:
    given = tensors(TINY)
    frames, noisy = len(given["noise"]), given[f"denoise_sigma{sigma}_in"]
    expected = given[f"denoise_sigma{sigma}_out"]
    clean = denoise(tiny_velocity(given), noisy, float(sigma), torch.ones(frames), mask_of("c0", frames))
    close(clean, expected, LIMIT)


@pytest.mark.parametrize("name", cases(TINY, r"out\.(.+)"))
def test_golden_engine_runs_with_a_tiny_unet(name: str) -> None:
    given = tensors(TINY)
    (guider, known), frames = name.split("_"), len(given["noise"])
    scale = guidance("constant" if guider == "vanilla" else "triangle", frames)
    velocity, mask = tiny_velocity(given), mask_of(known, frames)
    made = sample(velocity, given["noise"], scale, mask, given["cond_frame"], TINY_STEPS)
    close(made, given[f"out.{name}"], 2 * LIMIT)
