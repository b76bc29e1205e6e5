"""How the representations of motion start, and that a short fit of each moves what moves."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from dreamdrive.fit import DensifySettings, FitOptions, Parts, SeedOptions, fit, fit_static, initialise
from dreamdrive.motion import (
    DeformationConfig,
    HexPlaneConfig,
    HexPlaneField,
    Start,
    Tracks,
    Vibration,
    VibrationConfig,
    start_motion,
)
from dreamdrive.scene.scene import Scene
from dreamdrive.splat.scene_view import render_scene
from tests.streets import small_street, street_clip, true_geometry

PLANES = HexPlaneConfig(width=32, features=8, resolution=32, levels=2)
STEPS = 200


@pytest.fixture(scope="module")
def street():
    return small_street(size=(160, 96), frames=9)


@pytest.fixture(scope="module")
def stages(street):
    clip, geometry = street_clip(street), true_geometry(street)
    seeds = initialise(clip, geometry, SeedOptions(stride_px=3))
    start = fit_static(clip, geometry, seeds, FitOptions(steps=60), 0, lambda done, total: None)
    return clip, geometry, start


def fitted(stages, config: Any, steps: int = STEPS, counted: list[int] | None = None):
    clip, geometry, start = stages
    none = start.gaussians.select(torch.zeros(0, dtype=torch.int64))
    static = config is None
    parts = Parts(start.gaussians, none, None, ()) if static else Parts(none, start.gaussians, None, ())
    options = FitOptions(steps=steps, warm_up=0.05, plane_rate=5e-2)

    def progress(done: int, total: int) -> None:
        if counted is not None:
            counted.append(done)

    motion = DeformationConfig() if static else config
    return fit(clip, geometry, parts, start, options, motion, DensifySettings(), 0, progress)


def error_of_movers(scene, clip, street) -> float:
    """Mean squared error over all pixels of moving things."""
    squared = []
    for frame in range(len(clip)):
        colour = render_scene(scene, scene.cameras[frame], float(clip.times_s[frame])).colour.numpy()
        squared.append((colour - clip.frames[frame] / 255.0)[street.moving[frame]] ** 2)
    return float(np.concatenate(squared).mean())


@pytest.fixture(scope="module")
def static_error(stages, street) -> float:
    return error_of_movers(fitted(stages, None), stages[0], street)


@pytest.fixture(scope="module", params=[(PLANES, 0.98), (VibrationConfig(), 0.8)])
def moving(request, stages) -> tuple[Scene, float]:
    """A scene of each motion, and the share of the static one's error that it leaves at most."""
    config, share = request.param
    return fitted(stages, config), share


def test_moving_things_are_shown_better_than_by_static_gaussians(
    stages, street, static_error: float, moving: tuple[Scene, float]
) -> None:
    scene, share = moving
    assert error_of_movers(scene, stages[0], street) < share * static_error


def test_gaussians_of_the_moving_car_move_most(stages, moving: tuple[Scene, float]) -> None:
    clip, scene = stages[0], moving[0]
    on_car = scene.dynamic.features[:, 0] > 0.5  # moving evidence of the seeds, which their children keep
    ends = [scene.deformation.apply_at(scene.dynamic, float(clip.times_s[i])).means for i in (2, 6)]
    moved_m = torch.linalg.vector_norm(ends[1] - ends[0], dim=1)
    assert moved_m[on_car].mean() > 2 * moved_m[~on_car].median()


@pytest.mark.parametrize("config", [None, DeformationConfig(), PLANES, VibrationConfig()])
def test_all_representations_take_the_same_steps(stages, config: Any) -> None:
    counted: list[int] = []
    fitted(stages, config, steps=4, counted=counted)
    assert counted == [1, 2, 3, 4]


@pytest.mark.parametrize("config", [PLANES, VibrationConfig()])
def test_a_fit_depends_on_its_seed_alone(stages, config: Any) -> None:
    one, two = (fitted(stages, config, steps=8) for _ in range(2))
    for name, value in one.dynamic.tensors().items():
        assert torch.equal(value, two.dynamic.tensors()[name]), name
    for name, value in one.deformation.state_dict().items():
        assert torch.equal(value, two.deformation.state_dict()[name]), name


def test_planes_cover_nearly_all_gaussians_and_the_clip(stages) -> None:
    clip, geometry, start = stages
    motion, dynamic = start_motion(PLANES, Start(clip, geometry, start.gaussians, None, 0))
    assert isinstance(motion, HexPlaneField)
    assert dynamic is start.gaussians
    inside = ((dynamic.means >= motion.low_m) & (dynamic.means <= motion.high_m)).float().mean(0)
    assert (inside > 0.97).all()
    assert (inside < 0.99).all()
    assert motion.time_range_s.tolist() == [clip.times_s[0], clip.times_s[-1]]
    assert (motion.config.times, motion.config.coefficients) == (4, 4)


def test_vibration_starts_at_rest_where_and_when_a_frame_saw_it(stages) -> None:
    clip, geometry, start = stages
    late = replace(clip, times_s=clip.times_s * 3)
    motion, dynamic = start_motion(VibrationConfig(), Start(late, geometry, start.gaussians, None, 0))
    assert isinstance(motion, Vibration)
    interval_s = float(late.times_s[1] - late.times_s[0])
    assert motion.config.cycle_s == pytest.approx(10 * interval_s)
    assert (dynamic.velocity == 0).all()
    assert dynamic.lifespan[:, 0].numpy() == pytest.approx(late.times_s[dynamic.source_frame.numpy()])
    assert dynamic.lifespan[:, 1].numpy() == pytest.approx(15 * interval_s)


def test_tracks_are_for_deformation_fields(stages) -> None:
    clip, geometry, start = stages
    tracks = Tracks(np.zeros(1), np.zeros((1, 1, 3)), np.zeros((1, 1)), np.zeros((1, 3)))
    with pytest.raises(ValueError, match="knows no tracks"):
        start_motion(VibrationConfig(), Start(clip, geometry, start.gaussians, tracks, 0))
