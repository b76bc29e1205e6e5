"""The fits on the built-in street with exact geometry: small, so that a wrong sign shows within seconds."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch

from dreamdrive.decompose import ActorOptions, GroupOptions, find_actors, group
from dreamdrive.fit import DensifySettings, FitOptions, Parts, SeedOptions, fit, fit_static, initialise
from dreamdrive.motion import DeformationConfig
from dreamdrive.splat.scene_view import render_scene
from tests.streets import small_street, street_clip, true_geometry

REACH_PX = SeedOptions().reach_px


def quiet(done: int, total: int) -> None:
    """No progress bar."""


@pytest.fixture(scope="module")
def street():
    return small_street(size=(160, 96), frames=9)


@pytest.fixture(scope="module")
def stages(street):
    clip, geometry = street_clip(street, hold_out=8), true_geometry(street)
    seeds = initialise(clip, geometry, SeedOptions(moving_stride_px=2))
    start = fit_static(clip, geometry, seeds, FitOptions(steps=60), 0, quiet)
    grouping = group(clip, geometry, seeds, seeds.features[:, 0].clone(), GroupOptions(), REACH_PX)
    return clip, geometry, seeds, start, grouping


def fitted(stages, representation: str, steps: int = 120, seed: int = 0):
    clip, geometry, seeds, start, grouping = stages
    none = seeds.select(torch.zeros(0, dtype=torch.int64))
    if representation == "static":
        parts = Parts(start.gaussians, none, None, ())
    elif representation == "deformable":
        parts = Parts(none, start.gaussians, None, ())
    else:
        whole = find_actors(clip, geometry, seeds, grouping, ActorOptions(), REACH_PX)
        static = start.gaussians.select(grouping.static)
        parts = Parts(static, whole.gaussians, whole.tracks, whole.actors)
    network = DeformationConfig(width=32)
    return fit(clip, geometry, parts, start, FitOptions(steps=steps), network, DensifySettings(), seed, quiet)


@pytest.fixture(scope="module")
def hybrid(stages):
    return fitted(stages, "hybrid")


def error(scene, clip, frame: int, mask: np.ndarray | None = None) -> float:
    view = render_scene(scene, scene.cameras[frame], float(clip.times_s[frame]))
    difference = (view.colour.numpy() - clip.frames[frame] / 255.0) ** 2
    return float(difference[mask].mean() if mask is not None else difference.mean())


def test_the_hybrid_shows_the_moving_car_where_static_gaussians_cannot(stages, street, hybrid):
    clip = stages[0]
    frame = int(np.flatnonzero(clip.held_out)[0])
    static = fitted(stages, "static")
    moving = street.moving[frame]
    assert error(hybrid, clip, frame, moving) < 0.7 * error(static, clip, frame, moving)
    assert error(hybrid, clip, frame) < 10 ** (-2.2)


def test_one_car_is_seen_once_at_any_time(hybrid, street):
    """Copies seeded by other frames must not show as ghosts, between frames neither."""
    for t_s in np.linspace(hybrid.times_s[0], hybrid.times_s[-1], 12):
        nearest = int(np.argmin(np.abs(hybrid.times_s - t_s)))
        mask = render_scene(hybrid, hybrid.cameras[nearest], float(t_s)).dynamic.numpy().astype(np.uint8)
        closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((5, 5)))
        sizes = cv2.connectedComponentsWithStats(closed)[2][1:, cv2.CC_STAT_AREA]
        assert (sizes > 0.1 * street.moving[nearest].sum()).sum() == 1, (t_s, sizes)


def test_all_gaussians_of_the_deformable_baseline_are_dynamic(stages):
    scene = fitted(stages, "deformable", steps=10)
    assert len(scene.static) == 0
    assert scene.deformation is not None
    assert len(scene.dynamic) > 0


def test_a_fit_depends_on_its_seed_alone(stages):
    one, two = fitted(stages, "hybrid", steps=12), fitted(stages, "hybrid", steps=12)
    for name, value in one.static.tensors().items():
        assert torch.equal(value, two.static.tensors()[name]), name
    for name, value in one.deformation.state_dict().items():
        assert torch.equal(value, two.deformation.state_dict()[name]), name
    other = fitted(stages, "hybrid", steps=12, seed=1)
    assert not torch.equal(one.static.means, other.static.means)


def test_held_out_frames_are_not_seen(stages):
    clip, geometry, seeds, start, grouping = stages
    blind = replace(
        clip, frames=np.where(clip.held_out[:, None, None, None], 0, clip.frames).astype(np.uint8)
    )
    seen = fitted(stages, "hybrid", steps=10)
    unseen = fitted((blind, geometry, seeds, start, grouping), "hybrid", steps=10)
    assert torch.equal(seen.static.means, unseen.static.means)
    assert torch.equal(seen.dynamic.means, unseen.dynamic.means)


def test_exposure_exists_for_training_frames_only(stages):
    clip = stages[0]
    scene = fitted(stages, "hybrid", steps=5)
    np.testing.assert_array_equal(scene.exposure.times_s, clip.times_s[~clip.held_out])


def test_even_light_comes_out_as_even_exposure():
    # The last steps used to leave each frame's exposure where its last look had thrown it, up to 4 % off.
    street = small_street(size=(96, 64), frames=9)
    clip, geometry = street_clip(street), true_geometry(street)
    seeds = initialise(clip, geometry)
    found = fit_static(clip, geometry, seeds, FitOptions(steps=150), 0, quiet)
    grey = torch.full((1, 1, 3), 0.5)
    shown = [found.exposure.apply(grey, t).mean().item() for t in street.times_s.tolist()]
    recorded = [street.world.exposure(t) ** 0.5 for t in street.times_s.tolist()]
    ratio = np.array(shown) / recorded
    assert np.ptp(ratio) < 0.015 * ratio.mean()
