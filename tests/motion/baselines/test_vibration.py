"""Periodic vibration: the formulas, their gradients, and what a step of the fit sees."""

import math
from dataclasses import replace

import pytest
import torch

from dreamdrive.motion import Vibration, VibrationConfig
from dreamdrive.scene.gaussians import Gaussians
from tests.scene.scenes import gaussians

CONFIG = VibrationConfig(interval_s=0.2, cycle_frames=8.0)
CYCLE_S = 1.6


def swinging(count: int = 4, dtype: torch.dtype = torch.float64) -> Gaussians:
    g = torch.Generator().manual_seed(7)
    velocity = torch.randn(count, 3, generator=g)
    lifespan = torch.stack([torch.rand(count, generator=g), 0.2 + torch.rand(count, generator=g)], dim=1)
    start = gaussians(count, 0, velocity=velocity, lifespan=lifespan)
    return Gaussians(**{n: v.to(dtype) if v.is_floating_point() else v for n, v in start.tensors().items()})


@pytest.mark.parametrize("t_s", [-0.3, 0.4, 1.1])
def test_means_swing_and_opacities_fade(t_s: float) -> None:
    start = swinging()
    now = Vibration(CONFIG).apply_at(start, t_s)
    for i in range(len(start)):
        peak_s, span_s = start.lifespan[i].tolist()
        swing = CYCLE_S / (2 * math.pi) * math.sin(2 * math.pi * (t_s - peak_s) / CYCLE_S)
        torch.testing.assert_close(now.means[i], start.means[i] + swing * start.velocity[i])
        opacity = 1 / (1 + math.exp(-start.logit_opacities[i].item()))
        expected = opacity * math.exp(-0.5 * (t_s - peak_s) ** 2 / span_s**2)
        assert now.logit_opacities[i].sigmoid().item() == pytest.approx(expected)
    assert now.lifespan is None
    assert now.velocity is None
    for name in ("quaternions", "log_scales", "sh"):
        assert torch.equal(getattr(now, name), getattr(start, name))


def test_at_the_peak_it_goes_through_its_place_at_its_velocity() -> None:
    start = swinging(1)
    peak_s, motion = start.lifespan[0, 0].item(), Vibration(CONFIG)
    torch.testing.assert_close(motion.apply_at(start, peak_s).means, start.means)
    ahead, behind = (motion.apply_at(start, peak_s + step).means for step in (1e-4, -1e-4))
    torch.testing.assert_close((ahead - behind) / 2e-4, start.velocity, rtol=1e-6, atol=0)


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_gradients(share: float) -> None:
    start, motion = swinging(3), Vibration(replace(CONFIG, shift_share=share))
    names = ("means", "velocity", "lifespan", "logit_opacities")

    def moved(*values: torch.Tensor) -> tuple[torch.Tensor, ...]:
        changed = replace(start, **dict(zip(names, values, strict=True)))
        now = motion.training_at(changed, 0.6, torch.Generator().manual_seed(0))
        return now.means, now.logit_opacities, motion.penalty(changed, now)

    assert torch.autograd.gradcheck(moved, [getattr(start, n).clone().requires_grad_() for n in names])


def test_a_neighbouring_time_is_carried_on_by_the_mean_velocities() -> None:
    start, t_s = swinging(), 0.6
    motion = Vibration(replace(CONFIG, shift_share=1.0, shift_frames=2.0))
    _, place = torch.rand(2, generator=torch.Generator().manual_seed(4)).tolist()
    shift_s = (2 * place - 1) * 2.0 * 0.2
    seen = motion.training_at(start, t_s, torch.Generator().manual_seed(4))
    there = motion.apply_at(start, t_s - shift_s)
    slowed = start.velocity * torch.exp(-start.lifespan[:, 1:] / CYCLE_S / 2)
    torch.testing.assert_close(seen.means, there.means + shift_s * slowed)
    torch.testing.assert_close(seen.logit_opacities, there.logit_opacities)
    assert not torch.allclose(seen.means, motion.apply_at(start, t_s).means)


def test_half_of_the_steps_see_the_time_itself() -> None:
    start, motion, generator = swinging(), Vibration(CONFIG), torch.Generator().manual_seed(0)
    plain = motion.apply_at(start, 0.5)
    same = [torch.equal(motion.training_at(start, 0.5, generator).means, plain.means) for _ in range(200)]
    assert 70 < sum(same) < 130


def test_the_penalty_is_the_mean_speed_of_the_living() -> None:
    start, motion = swinging(), Vibration(CONFIG)
    slowed = start.velocity * torch.exp(-start.lifespan[:, 1:] / CYCLE_S / 2)
    found = motion.penalty(start, motion.apply_at(start, 0.5))
    assert found.item() == pytest.approx(0.005 * slowed.abs().mean().item())
    nothing = start.select(torch.zeros(0, dtype=torch.int64))
    assert motion.penalty(nothing, motion.apply_at(nothing, 0.5)) is None


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="no velocity"):
        Vibration(CONFIG).apply_at(gaussians(2, 0), 0.5)
    with pytest.raises(ValueError, match="above 0"):
        VibrationConfig(interval_s=0.0)
