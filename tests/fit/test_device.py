"""The fit on another device than the CPU: the same losses, and no tensor of the CPU in its steps."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from dreamdrive.compute.device import CPU
from dreamdrive.fit import DensifySettings, FitOptions, Parts, SeedOptions, fit, fit_static, initialise
from dreamdrive.fit.trainer import Trainer
from dreamdrive.motion import REPRESENTATIONS, Tracks
from dreamdrive.options import QUALITIES
from tests.fit.pretended import DEVICE, Elsewhere, pretending, splat_there
from tests.streets import small_street, street_clip, true_geometry

STEPS = 25
# Of the loss, relative: Adam makes a whole step of a gradient that is nothing but rounding, as at nodes of a
# hexplane that hardly count. Once something was split, one Gaussian on the edge of that may tell it apart.
BEFORE, AFTER = {"hexplane": 2e-3}, 2e-2
FIRST_SPLIT = 10
GROWING = DensifySettings(start=0.3, stop=1.0, every=FIRST_SPLIT, gradient=1e-4)


@pytest.fixture(scope="module")
def street():
    street = small_street(size=(48, 32), frames=5)
    clip, geometry = street_clip(street, hold_out=4), true_geometry(street)
    return clip, geometry, initialise(clip, geometry, SeedOptions(stride_px=4, moving_stride_px=2))


@pytest.fixture
def losses(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The loss of every step; off the CPU the reference splats."""
    told: list[float] = []
    step = Trainer.step

    def listening(self: Trainer, *given: Any) -> torch.Tensor:
        loss = step(self, *given)
        told.append(loss.item())
        return loss

    monkeypatch.setattr(Trainer, "step", listening)
    splat_there(monkeypatch)
    return told


def parts_of(name: str, start: Any) -> Parts:
    """The Gaussians of a static fit as a representation takes them: two tracks where it tells them apart."""
    seeds, moves = start.gaussians, REPRESENTATIONS[name].moves
    moving = seeds.features[:, 0] > 0
    if moves != "scored":
        none = seeds.select(torch.zeros(0, dtype=torch.int64))
        return Parts(seeds, none, None, ()) if moves == "none" else Parts(none, seeds, None, ())
    actor = torch.arange(int(moving.sum())) % 2
    life = torch.tensor([0.2, 0.3]).expand(len(actor), 2).contiguous()
    dynamic = replace(seeds.select(moving), actor=actor, lifespan=life)
    tracks = Tracks(np.array([0.0, 0.2, 0.4]), np.zeros((2, 3, 3)), np.zeros((2, 3)), np.zeros((2, 3)))
    return Parts(seeds.select(~moving), dynamic, tracks, ())


def fitted(street: Any, name: str, device: torch.device) -> Any:
    clip, geometry, seeds = street
    start = fit_static(clip, geometry, seeds, FitOptions(steps=2), 0, lambda done, total: None)
    options = FitOptions(steps=STEPS, warm_up=0.1, sh_after=0.4)
    motion = replace(QUALITIES["draft"], representation=name).motion
    return fit(
        clip, geometry, parts_of(name, start), start, options, motion, GROWING, 0, lambda d, t: None, device
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", REPRESENTATIONS)
def test_every_representation_has_the_same_losses_off_the_cpu(street, losses, name: str) -> None:
    here = fitted(street, name, CPU)
    expected = losses[2:]
    losses.clear()
    with pretending() as device:
        there = fitted(street, name, device)
    found = losses[2:]
    assert len(found) == len(expected) == STEPS
    assert found[:FIRST_SPLIT] == pytest.approx(expected[:FIRST_SPLIT], rel=BEFORE.get(name, 3e-4))
    assert found == pytest.approx(expected, rel=AFTER)
    for one, other in ((here.static, there.static), (here.dynamic, there.dynamic)):
        assert abs(len(one) - len(other)) <= 0.02 * len(one)
        assert not any(isinstance(value, Elsewhere) for value in other.tensors().values())
    assert len(here.static) + len(here.dynamic) > len(street[2])


def test_the_static_fit_has_the_same_losses_off_the_cpu(street, losses) -> None:
    clip, geometry, seeds = street
    for device in (CPU, DEVICE):
        with pretending():
            fit_static(clip, geometry, seeds, FitOptions(steps=STEPS), 0, lambda done, total: None, device)
    assert losses[STEPS:] == pytest.approx(losses[:STEPS], rel=1e-4)


def test_the_pretended_device_refuses_tensors_of_the_cpu() -> None:
    with pretending() as device:
        with pytest.raises(RuntimeError, match="a tensor of the CPU"):
            torch.ones(3, device=device) + torch.ones(3)
        with pytest.raises((RuntimeError, TypeError)):
            torch.ones(3, device=device).numpy()
