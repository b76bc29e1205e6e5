"""What a fit takes on a GPU is told beforehand, and is what is taken."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.fit import (
    DensifySettings,
    ExposureNetwork,
    FitOptions,
    FitSize,
    GradientDensifier,
    LearningRates,
    Model,
    Parameters,
    Trainer,
    check_fit,
    fit_static,
    initialise,
    memory,
    most_gaussians,
    plan_fit,
)
from dreamdrive.fit.views import CompactView, View, training_views
from dreamdrive.motion import DeformationConfig
from dreamdrive.motion.deformation import DeformationField
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.sky import Sky
from dreamdrive.splat import cuda
from tests.fit.allocating import Living, as_on_a_gpu
from tests.fit.pretended import pretending
from tests.streets import small_street, street_clip, true_geometry

GB = 10**9
SKY = Sky(torch.zeros(2, 2, 3), (-1.0, 1.0), (-1.0, 1.0))
PAPER = FitSize(3_000_000, 300_000, 6 * 24, (1600, 900), cameras=6, motion=DeformationConfig())


def some(size: FitSize, count: int) -> Parameters | None:
    gaussians = Gaussians(
        means=torch.rand(count, 3),
        quaternions=torch.rand(count, 4),
        log_scales=torch.zeros(count, 3),
        logit_opacities=torch.zeros(count),
        sh=torch.zeros(count, size.coefficients, 3),
        source_frame=torch.zeros(count, dtype=torch.int64),
        features=torch.zeros(count, size.features),
    )
    return Parameters(gaussians, torch.ones(count), LearningRates()) if count else None


def frames(size: FitSize) -> list[CompactView]:
    width, height = size.size_px
    camera = Camera(width, width, width / 2, height / 2, width, height)

    def view(index: int) -> CompactView:
        flag, value = torch.ones(height, width, dtype=torch.bool), torch.ones(height, width)
        whole = View(index, 0.5, camera, torch.ones(height, width, 3), flag, flag, value, value, flag)
        return CompactView.of(whole, np.zeros((height, width, 3), np.uint8), torch.device("cpu"))

    return [view(index) for index in range(size.views)]


def steps(size: FitSize, living: Living, settings: DensifySettings, count: int = 3) -> Model:
    """Some steps of a fit of that size; ``living`` tells the most that was there."""
    motion = None if size.motion is None else DeformationField.blank(size.motion)
    standing = some(size, size.gaussians - size.moving)
    model = Model(standing, some(size, size.moving), motion, SKY, ExposureNetwork(size.views))
    views, half = frames(size), (size.size_px[0] / 2, size.size_px[1] / 2)
    densifiers = [GradientDensifier(settings, len(part), half) for part in model.parts()]
    trainer = Trainer(model, densifiers, FitOptions(steps=10), torch.Generator())
    sky = torch.zeros(*size.size_px[::-1], 3)
    del standing
    living.peak = living.now
    for step in range(4, 4 + count):
        trainer.step(step, views[0].whole(), sky)
    return model


def test_what_is_kept_is_counted_by_hand() -> None:
    """Learned are 3 + 4 + 3 + 1 + 3 x 4 numbers; carried 3 + 1 and 5, a frame of 8 bytes, and two sums."""
    plan = plan_fit(FitSize(1000, 0, 7, (100, 50), features=5))
    assert plan.parameters == 1000 * (4 * 23 + 4 * 4 + 4 * 5 + 8 + 4 * 2)
    assert plan.moments == 1000 * 2 * 4 * 23
    assert plan.views == 7 * 100 * 50 * (3 + 1 + 4 + 2)
    assert plan.network == 0
    assert plan.living == plan.parameters + plan.moments + plan.splat + plan.maps + plan.views
    assert 1.05 * plan.living < plan.peak < 1.2 * plan.living


SIZES = {
    "Gaussians": FitSize(40_000, 0, 1, (64, 48), features=5),
    "more colour": FitSize(30_000, 0, 1, (64, 48), coefficients=16, features=17),
    "pixels": FitSize(2_000, 0, 3, (640, 360), features=5),
    "both": FitSize(100_000, 0, 2, (320, 180), features=5),
    "packed": FitSize(60_000, 0, 1, (64, 48), cameras=6, features=5),
    "moving": FitSize(40_000, 8_000, 2, (160, 90), features=5, motion=DeformationConfig()),
    "the paper's network": FitSize(
        10_000, 5_000, 1, (64, 48), features=5, motion=DeformationConfig(depth=8, width=256)
    ),
}


@pytest.mark.parametrize("name", SIZES)
def test_the_plan_is_what_steps_take(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    size = SIZES[name]
    above = 0 if name == "packed" else cuda.PACKED_ABOVE
    monkeypatch.setattr(cuda, "PACKED_ABOVE", above)
    monkeypatch.setattr(memory, "PACKED_ABOVE", above)
    with as_on_a_gpu(monkeypatch, tiles=4, share=1 / size.cameras) as living:
        steps(size, living, DensifySettings(start=2.0))
    assert plan_fit(size).living == pytest.approx(living.peak, rel=0.15)


def test_growth_takes_no_more_than_a_step_after_it(monkeypatch: pytest.MonkeyPatch) -> None:
    size = FitSize(20_000, 0, 1, (64, 48), features=5)
    growing = DensifySettings(start=0.0, stop=1.0, every=1, gradient=-1.0, most=40_000, prune_opacity=0.0)
    with as_on_a_gpu(monkeypatch, tiles=4) as living:
        model = steps(size, living, growing, count=1)
        assert model.static is not None
        assert len(model.static) == 40_000
        grown = living.peak
    assert 0.5 * grown < plan_fit(replace(size, gaussians=40_000)).living
    assert grown <= plan_fit(replace(size, gaussians=40_000)).living


@pytest.fixture(scope="module")
def street() -> tuple[Clip, Geometry]:
    drawn = small_street(size=(96, 64), frames=4)
    return street_clip(drawn), true_geometry(drawn)


def test_views_on_a_device_are_those_of_the_cpu_in_as_many_bytes_as_planned(street) -> None:
    clip, geometry = street
    expected = training_views(clip, geometry)
    with pretending() as device:
        compact = training_views(clip, geometry, device)
        found = [view.whole() for view in compact]
    names = ("image", "mask", "sky", "depth_m", "depth_weight", "still")
    for one, other in zip(found, expected, strict=True):
        for name in names:
            there, here = getattr(one, name).here, getattr(other, name)
            torch.testing.assert_close(there, here, atol=1e-3 if name == "depth_weight" else 0.0, rtol=0.0)
    held = [getattr(view, name) for view in compact for name in ("image", "flags", "depth_m", "depth_weight")]
    planned = plan_fit(FitSize(0, 0, len(expected), (96, 64))).views
    assert sum(each.nbytes for each in held) == planned


def test_the_papers_size_fits_in_16_gb_and_what_does_not_is_refused_with_a_size_that_does() -> None:
    check_fit(PAPER, 16 * GB)
    check_fit(PAPER, None)
    deep = replace(PAPER, coefficients=16, motion=DeformationConfig(depth=8, width=256))
    assert 16 * GB > plan_fit(deep).peak > 1.5 * plan_fit(PAPER).peak
    needs = r"3,000,000 Gaussians to 144 frames at 1600x900 needs about .*, and 4\.0 GB are free"
    with pytest.raises(InputError, match=needs) as told:
        check_fit(PAPER, 4 * GB)
    width, height = map(int, str(told.value).split("--size ")[1].split(",")[0].split("x"))
    share = width * height / (1600 * 900)
    assert plan_fit(PAPER.smaller(share)).peak <= 4 * GB
    assert share > 0.5
    with pytest.raises(InputError, match=r"at least 3,000,000 Gaussians .*: give fewer --frames"):
        check_fit(PAPER, 10**6, least=True)


def test_each_part_that_grows_counts_with_what_it_may_grow_to(street) -> None:
    clip, geometry = street
    seeds = initialise(clip, geometry)
    none, few = seeds.select(torch.arange(0)), seeds.select(torch.arange(7))
    size = memory.size_of(clip, seeds, few, PAPER.motion, most=100)
    assert (size.gaussians, size.moving) == (len(seeds) + 100, 100)
    assert (size.views, size.size_px, size.coefficients, size.features) == (4, (96, 64), 4, 5)
    alone = memory.size_of(clip, seeds, none, PAPER.motion, most=10**6)
    assert (alone.gaussians, alone.moving) == (10**6, 0)
    every = memory.size_of(clip, none, few, PAPER.motion, most=0)
    assert (every.gaussians, every.moving) == (7, 7)


def test_a_gpu_is_told_what_it_holds() -> None:
    most = most_gaussians(PAPER, 16 * GB)
    assert plan_fit(replace(PAPER, gaussians=most)).peak <= 16 * GB
    assert plan_fit(replace(PAPER, gaussians=most + 1)).peak > 16 * GB
    assert most_gaussians(PAPER, GB) == 0


def test_a_fit_that_the_gpu_cannot_hold_is_refused_before_it_takes_anything(
    street, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip, geometry = street
    seeds, asked = initialise(clip, geometry), []
    monkeypatch.setattr(memory, "free_bytes", lambda device: asked.append(device.type) or 10_000)
    options, there = FitOptions(steps=1), torch.device("cuda")
    with pytest.raises(InputError, match=f"a fit of {len(seeds):,} Gaussians to 4 frames at 96x64"):
        fit_static(clip, geometry, seeds, options, 0, lambda done, total: None, there)
    assert asked == ["cuda"]
