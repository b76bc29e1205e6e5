"""One training step against the same step in plain torch, whatever the threads."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.fit.densify import Densifier, DensifySettings, GradientDensifier
from dreamdrive.fit.exposure import ExposureNetwork
from dreamdrive.fit.initialise import SeedOptions, initialise
from dreamdrive.fit.parameters import LearningRates, Parameters
from dreamdrive.fit.sky import estimate_sky
from dreamdrive.fit.static import footprints
from dreamdrive.fit.trainer import FitOptions, Model, Trainer, optimise
from dreamdrive.fit.views import View, training_views
from dreamdrive.motion import DeformationConfig, DeformationField, Domain, Tracks
from dreamdrive.splat import set_threads, threads
from dreamdrive_bench.splat.plain_step import PlainTrainer
from tests.streets import small_street, street_clip, true_geometry

OPTIONS = FitOptions(steps=20, sh_after=0.0, warm_up=0.0)


@pytest.fixture(scope="module")
def parts():
    """Views, Gaussians (every third of which is an actor's) and sky of a small street."""
    street = small_street(size=(96, 64), frames=5)
    clip, geometry = street_clip(street), true_geometry(street)
    seeds = initialise(clip, geometry, SeedOptions(moving_stride_px=4)).without_features()
    count = len(seeds)
    colour = torch.cat([seeds.sh[:, :1], torch.zeros(count, 3, 3)], dim=1)
    life = torch.stack([torch.linspace(0, float(clip.times_s[-1]), count), torch.full((count,), 0.3)], 1)
    actor = torch.where(torch.arange(count) % 3 == 0, torch.arange(count) % 2, -1)
    seeds = replace(seeds, sh=colour, lifespan=life, actor=actor)
    return training_views(clip, geometry), seeds, estimate_sky(clip, geometry)


def model_of(parts) -> Model:
    _, seeds, sky = parts
    tracks = Tracks(
        np.array([0.0, 0.5]), np.ones((2, 2, 3)) * 0.1, np.array([[0, 0.1], [0, 0]]), np.zeros((2, 3))
    )
    field = DeformationField(
        DeformationConfig(width=16, depth=2, actors=2, track_times=2),
        Domain(np.array([0.0, 0, 10]), 10.0, 0.0, 0.5, np.array([0.0, -1, 0])),
        tracks,
    )
    for head in (field.head_mean, field.head_quaternion, field.head_log_scale):
        torch.nn.init.normal_(head.weight, std=0.01, generator=torch.Generator().manual_seed(0))
    static = replace(seeds.select(seeds.actor < 0), actor=None, lifespan=None)
    dynamic = seeds.select(seeds.actor >= 0)
    both = (Parameters(part, footprints(part), LearningRates()) for part in (static, dynamic))
    return Model(*both, field, sky, ExposureNetwork(5, 0))


def trainer_of(parts) -> Trainer:
    model = model_of(parts)
    densifiers = [GradientDensifier(DensifySettings(), len(p), (48.0, 32.0)) for p in model.parts()]
    return Trainer(model, densifiers, OPTIONS, torch.Generator().manual_seed(0))


def take_steps(trainer: Trainer | PlainTrainer, views: list[View], sky, count: int) -> None:
    with one_torch_thread():
        for step in range(count):
            trainer.step(step, views[step], sky.colour(views[step].camera))


def state(model: Model) -> dict[str, torch.Tensor]:
    """Everything a fit changes, by name."""
    out = {f"network {n}": p.detach() for n, p in model.deformation.named_parameters()}
    out |= {f"exposure {n}": p.detach() for n, p in model.exposure.named_parameters()}
    for which, part in (("static", model.static), ("dynamic", model.dynamic)):
        for name, memory in part.moments.items():
            out[f"{which} {name}"] = getattr(part, name).detach()
            out[f"{which} {name}, mean"], out[f"{which} {name}, square"] = memory.mean, memory.square
    return out


def test_a_step_is_that_of_plain_torch(parts) -> None:
    views, _, sky = parts
    ours, theirs = trainer_of(parts), PlainTrainer(model_of(parts), OPTIONS)
    take_steps(ours, views, sky, 1)
    take_steps(theirs, views, sky, 1)
    for part, plain in ((ours.model.static, theirs.static), (ours.model.dynamic, theirs.dynamic)):
        for name in ("offsets", "quaternions", "log_scales", "logit_opacities", "sh"):
            # After one step the mean is a tenth of the gradient; the step itself is only its sign.
            of_plain = ("sh_dc", "sh_rest") if name == "sh" else (name,)
            states = [plain.optimiser.state[getattr(plain, leaf)]["exp_avg"] for leaf in of_plain]
            expected = torch.cat(states, dim=1) if name == "sh" else states[0]
            assert (expected != 0).any(), name
            torch.testing.assert_close(
                part.moments[name].mean, expected, rtol=1e-3, atol=1e-4 * expected.abs().max().item()
            )
    for mine, other in (
        (ours.model.deformation, theirs.field),
        (ours.model.exposure, theirs.exposure),
    ):
        for (name, value), (_, wanted) in zip(mine.named_parameters(), other.named_parameters(), strict=True):
            off = (value - wanted).abs() > 1e-5
            assert off.float().mean() < 0.02, name  # a gradient of nearly nothing may change its sign
    pull = torch.cat([densifier._sum for densifier in ours.densifiers])
    torch.testing.assert_close(pull, theirs.pull, rtol=1e-3, atol=1e-4 * theirs.pull.max().item())
    assert torch.equal(torch.cat([densifier._seen for densifier in ours.densifiers]), theirs.seen)


def test_thread_count_changes_no_bit_of_three_steps(parts) -> None:
    views, _, sky = parts
    before, results = threads(), []
    try:
        for count in (1, 2, 3):
            set_threads(count)
            trainer = trainer_of(parts)
            take_steps(trainer, views, sky, 3)
            results.append(state(trainer.model))
    finally:
        set_threads(before)
    for other in results[1:]:
        for name, value in results[0].items():
            assert torch.equal(value, other[name]), name


class Greedy(Densifier):
    """A densifier that changes nothing and draws a given number of random numbers after each step."""

    def __init__(self, draws: int) -> None:
        self.draws = draws

    def update(self, parameters, step, steps, generator) -> None:
        torch.randn(self.draws, generator=generator)


def test_what_is_drawn_for_splits_leaves_the_order_of_the_frames(parts) -> None:
    ends = []
    for draws in (0, 3):
        model = model_of(parts)
        optimise(model, parts[0], [Greedy(draws), Greedy(draws)], OPTIONS, 0, lambda done, total: None)
        ends.append(state(model))
    assert all(torch.equal(ends[0][name], ends[1][name]) for name in ends[0])


def test_what_strays_over_what_stands_costs_and_fades(parts) -> None:
    """Where nothing moves dynamic Gaussians lose opacity by it, and static ones before them win some."""
    views, _, sky = parts
    view = replace(views[0], still=torch.ones_like(views[0].mask))
    pulls = []
    for weight in (0.0, 10.0):
        trainer = trainer_of(parts)
        trainer.options = replace(OPTIONS, stray_weight=weight)
        loss = trainer.step(0, view, sky.colour(view.camera))
        model = trainer.model
        pulls.append((loss, *(part.moments["logit_opacities"].mean for part in model.parts())))
    (free, static, dynamic), (dear, static_then, dynamic_then) = pulls
    assert dear > free
    assert (dynamic_then - dynamic).mean() > 0
    assert (static_then - static).mean() < 0


def test_what_nothing_covers_costs_and_closes(parts) -> None:
    """Where there is no sky Gaussians win opacity by it, where there is they do not."""
    views, _, sky = parts
    wins = []
    for is_sky in (False, True):
        view = replace(views[0], sky=torch.full_like(views[0].sky, is_sky))
        pulls = []
        for weight in (0.0, 10.0):
            trainer = trainer_of(parts)
            trainer.options = replace(OPTIONS, solid_weight=weight, sky_weight=0.0)
            trainer.step(0, view, sky.colour(view.camera))
            pulls.append(torch.cat([part.moments["logit_opacities"].mean for part in trainer.model.parts()]))
        wins.append((pulls[0] - pulls[1]).sum())
    assert wins[0] > 0
    assert wins[1] == 0
