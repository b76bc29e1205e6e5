"""Noise levels, guidance and Euler's rule against the public code."""

import pytest
import torch
from tests.prior.vista.conftest import Golden
from tests.prior.vista.golden import Given, golden_unet
from torch import Tensor

from dreamdrive.prior.vista.engine import Engine
from dreamdrive.prior.vista.kinds import ACTION_COLUMNS, VISTA
from dreamdrive.prior.vista.networks import Networks
from dreamdrive.prior.vista.rollout import Seen
from dreamdrive.prior.vista.sampler import (
    Branches,
    Fixed,
    Schedule,
    Velocity,
    denoise,
    guidance,
    sample,
    sigmas,
)
from dreamdrive.prior.vista.stored import Stored

NAMES: dict[str, Schedule] = {"VanillaCFG": "constant", "TrianglePredictionGuider": "triangle"}


@pytest.mark.parametrize("steps", [5, 10, 25, 50])
def test_golden_noise_levels(golden: Golden, steps: int) -> None:
    expected = golden.tensors("sampler")[f"sigmas_{steps}"]
    torch.testing.assert_close(torch.tensor(sigmas(steps)), expected, atol=0, rtol=4e-6)


def test_golden_guidance(golden: Golden) -> None:
    given = golden.tensors("sampler")
    for frames in (14, 25):
        torch.testing.assert_close(guidance("triangle", frames), given[f"triangle_scale_{frames}"][0])
        # The public ramp ends at 2.5, which nothing uses; that of SVD ends at 3.
        ramp = 1 + (guidance("linear", frames) - 1) * 1.5 / 2
        torch.testing.assert_close(ramp, given[f"linear_scale_{frames}"][0])


@pytest.mark.parametrize("guider", ["VanillaCFG", "TrianglePredictionGuider", "LinearPredictionGuider"])
@pytest.mark.parametrize(("name", "known"), [("none", []), ("c0", [0]), ("c012", [0, 1, 2])])
def test_golden_runs_with_a_linear_network(golden: Golden, guider: str, name: str, known: list[int]) -> None:
    given = golden.tensors("sampler")
    mask = torch.zeros(25)
    mask[known] = 1
    entered: list[Tensor] = []

    def velocity(x: Tensor, time: float, fixed: Tensor) -> Branches:
        plain = torch.einsum("oc,bchw->bohw", given["lin_A"], x) + 0.05 * time
        plain = plain + 0.1 * fixed[:, None, None, None]
        entered.append(x)
        return plain, plain + 0.2 * given["ctx"][:, :, None, None]

    scale = guidance(NAMES[guider], 25) if guider in NAMES else given["linear_scale_25"][0]
    made = sample(velocity, given["noise"], scale, Fixed(mask, given["cond_frame"]), 5)
    torch.testing.assert_close(made, given[f"{guider}.{name}.out"], atol=2e-5, rtol=0)
    for x, sigma, expected in zip(entered, sigmas(5), given[f"{guider}.{name}.x_in"], strict=False):
        torch.testing.assert_close(x * (sigma**2 + 1) ** 0.5, expected, atol=2e-5, rtol=1e-5)


class Held(Networks):
    """The golden UNet where a stored model would be."""

    def __init__(self, golden: Golden, vector: Tensor) -> None:
        unet = golden_unet(golden)
        unet.add_time_proj = Given(vector)  # type: ignore[assignment]
        super().__init__(Stored(golden.folder, VISTA, {}), torch.device("cpu"), half=False)
        self._held = "unet", unet


def tiny_velocity(golden: Golden, given: dict[str, Tensor]) -> Velocity:
    """What the engine makes of a round's conditions."""
    image, action = given["crossattn"][0, 0].split([64, ACTION_COLUMNS])
    engine = Engine(Held(golden, given["vector"][0]))
    return engine.velocity(Seen(image, given["concat"][0], action))


def test_golden_engine_runs_with_a_tiny_unet(golden: Golden) -> None:
    given = golden.tensors("sampler_tiny_unet")
    velocity, frames = tiny_velocity(golden, given), len(given["noise"])
    mask = torch.zeros(frames)
    mask[0] = 1
    constant = guidance("constant", frames)
    clean = denoise(velocity, given["denoise_sigma3_in"], 3.0, torch.ones(frames), mask)
    torch.testing.assert_close(clean, given["denoise_sigma3_out"], atol=1e-5, rtol=0)
    made = sample(velocity, given["noise"], constant, Fixed(mask, given["cond_frame"]), 4)
    torch.testing.assert_close(made, given["out.vanilla_c0"], atol=5e-5, rtol=0)
    mask[:3] = 1
    made = sample(velocity, given["noise"], guidance("triangle", frames), Fixed(mask, given["cond_frame"]), 4)
    torch.testing.assert_close(made, given["out.triangle_c012"], atol=5e-5, rtol=0)
