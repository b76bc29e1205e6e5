"""Shadows: found where road was seen beside an actor alone, and taken off."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.edit.shadow import shade_of, without_shade
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.scene import Scene
from tests.scene.scenes import make_scene

ROAD, SHADOW = 0.4, 0.2


@pytest.fixture
def actor() -> Actor:
    """A car that stands 10 m ahead, 1.5 m below the camera."""
    track = Track(np.array([0.0, 1.0]), np.array([[0.0, 1.5, 10.0]] * 2), np.zeros(2))
    box = ActorBox(np.array([4.0, 2.0, 1.5]), np.array([0.0, 0.0, 1.0]))
    return Actor(0, "actor 0", "vehicle", 1, track, box)


@pytest.fixture
def street(actor: Actor) -> Scene:
    """A level road, dark within half a metre of the car."""
    x, z = np.meshgrid(np.arange(-6, 6, 0.25), np.arange(3, 17, 0.25))
    means = torch.from_numpy(np.stack([x.ravel(), np.full(x.size, 1.5), z.ravel()], 1)).float()
    count = len(means)
    dark = (means[:, 0].abs() < 1.5) & ((means[:, 2] - 10).abs() < 2.5)
    colour = torch.where(dark, SHADOW, ROAD)[:, None, None].repeat(1, 1, 3)
    made = Gaussians(
        means=means,
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=torch.full((count, 3), -2.0),
        logit_opacities=torch.full((count,), 3.0),
        sh=(colour - 0.5) / SH_C0,
        source_frame=torch.zeros(count, dtype=torch.int64),
    )
    return replace(make_scene(), static=made, actors=(actor,))


def bright(scene: Scene) -> torch.Tensor:
    return scene.static.sh[:, 0, 0] * SH_C0 + 0.5


def test_what_was_seen_in_it_alone_becomes_as_bright_as_the_road(street: Scene, actor: Actor) -> None:
    seen = torch.ones(2, len(street.static))
    shade = shade_of(street, actor, [0.0, 1.0], seen, seen[0])
    assert shade is not None
    assert np.median(shade.share) == pytest.approx(SHADOW / ROAD, abs=1e-5)
    dark = (bright(street) < 0.3).numpy()
    assert dark[shade.rows].mean() > 0.8
    lit = without_shade(street, shade)
    assert bright(lit)[dark].median() == pytest.approx(ROAD, abs=1e-3)
    others = np.setdiff1d(np.arange(len(dark)), shade.rows)
    assert torch.equal(bright(lit)[others], bright(street)[others])


def test_what_was_seen_without_it_stays(street: Scene, actor: Actor) -> None:
    gone = replace(actor, track=replace(actor.track, positions_m=np.array([[0.0, 1.5, 10], [0.0, 1.5, 40]])))
    seen = torch.ones(2, len(street.static))
    assert shade_of(street, gone, [0.0, 1.0], seen, seen[0]) is None


def test_a_road_that_is_dark_everywhere_has_no_shadow(street: Scene, actor: Actor) -> None:
    even = replace(street, static=replace(street.static, sh=torch.zeros_like(street.static.sh)))
    seen = torch.ones(2, len(street.static))
    assert shade_of(even, actor, [0.0, 1.0], seen, seen[0]) is None
