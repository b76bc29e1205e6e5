from dataclasses import replace

import pytest
import torch

from dreamdrive.fit.densify import DensifySettings, GradientDensifier
from dreamdrive.fit.parameters import LearningRates, Parameters
from dreamdrive.scene.gaussians import Gaussians


def some_gaussians(count: int = 12) -> Gaussians:
    generator = torch.Generator().manual_seed(0)
    return Gaussians(
        means=torch.randn(count, 3, generator=generator),
        quaternions=torch.randn(count, 4, generator=generator),
        log_scales=torch.randn(count, 3, generator=generator) * 0.1 - 3,
        logit_opacities=torch.zeros(count),
        sh=torch.randn(count, 4, 3, generator=generator),
        source_frame=torch.arange(count) % 5,
        features=torch.randn(count, 7, generator=generator),
        lifespan=torch.rand(count, 2, generator=generator),
        actor=torch.arange(count) % 2,
    )


def parameters() -> Parameters:
    gaussians = some_gaussians()
    return Parameters(gaussians, torch.full((len(gaussians),), 0.1), LearningRates())


def one_step(p: Parameters) -> None:
    now = p.gaussians()
    (now.means.square().sum() + now.sh.square().sum() + now.log_scales.sum()).backward()
    p.step()


def test_frozen_returns_what_was_put_in():
    given, frozen = some_gaussians(), parameters().frozen()
    for name, value in given.tensors().items():
        torch.testing.assert_close(getattr(frozen, name), value)


def test_a_step_of_the_position_is_a_share_of_the_footprint():
    p = parameters()
    before = p.frozen().means
    one_step(p)
    moved = (p.frozen().means - before).abs()
    torch.testing.assert_close(
        moved, torch.full_like(moved, 0.1 * LearningRates().offsets), rtol=1e-3, atol=0
    )


def test_view_dependent_colour_has_a_step_of_its_own():
    p = parameters()
    before = p.frozen().sh
    one_step(p)
    moved, rates = (p.frozen().sh - before).abs(), LearningRates()
    torch.testing.assert_close(moved[:, :1], torch.full_like(moved[:, :1], rates.sh_dc), rtol=1e-3, atol=1e-6)
    torch.testing.assert_close(
        moved[:, 1:], torch.full_like(moved[:, 1:], rates.sh_rest), rtol=1e-2, atol=1e-6
    )


def test_the_step_of_the_position_decays():
    p = parameters()
    p.set_progress(1.0)
    before = p.frozen().means
    one_step(p)
    moved = (p.frozen().means - before).abs()
    torch.testing.assert_close(
        moved, torch.full_like(moved, 0.1 * LearningRates().offsets_end), rtol=1e-2, atol=0
    )


def test_keep_carries_the_moments_along():
    p = parameters()
    one_step(p)
    moments = p.moments["offsets"].mean.clone()
    mask = torch.arange(12) % 3 == 0
    p.keep(mask)
    assert len(p) == 4
    assert torch.equal(p.moments["offsets"].mean, moments[mask])
    assert p.moments["offsets"].square.shape == p.offsets.shape
    assert p.moments["offsets"].steps == 1
    one_step(p)


def test_children_inherit_all_but_the_changes_and_start_with_fresh_moments():
    p = parameters()
    one_step(p)
    parents = torch.tensor([3, 7])
    p.append_children(parents, {"log_scales": torch.full((2, 3), -9.0)})
    now = p.frozen()
    assert len(now) == 14
    for name in ("source_frame", "features", "lifespan", "actor", "means", "sh"):
        torch.testing.assert_close(getattr(now, name)[-2:], getattr(now, name)[parents])
    assert (now.log_scales[-2:] == -9).all()
    assert (p.moments["offsets"].mean[-2:] == 0).all()
    assert (p.moments["offsets"].mean[:12] != 0).any()
    one_step(p)


def swinging() -> Parameters:
    """Gaussians with velocities, of frames 0.25 s apart."""
    gaussians = replace(some_gaussians(), velocity=torch.linspace(-2, 2, 36).view(12, 3))
    return Parameters(gaussians, torch.full((12,), 0.1), LearningRates(interval_s=0.25))


def test_velocities_and_life_spans_are_learned_in_steps_of_their_own():
    p = swinging()
    before = p.frozen()
    torch.testing.assert_close(before.lifespan, some_gaussians().lifespan)
    torch.testing.assert_close(before.velocity, torch.linspace(-2, 2, 36).view(12, 3))
    now = p.gaussians()
    (now.velocity.sum() + now.lifespan.sum()).backward()
    p.step()
    after, rates = p.frozen(), LearningRates()
    step = 0.1 * rates.swings / 0.25
    torch.testing.assert_close(before.velocity - after.velocity, torch.full((12, 3), step), rtol=1e-3, atol=0)
    (peak_s, span_s), (new_peak_s, new_span_s) = before.lifespan.T, after.lifespan.T
    torch.testing.assert_close(peak_s - new_peak_s, torch.full((12,), rates.peak * 0.25), rtol=1e-3, atol=0)
    torch.testing.assert_close(
        (span_s / new_span_s).log(), torch.full((12,), rates.log_span), rtol=1e-3, atol=0
    )


def test_only_gaussians_with_velocities_learn_life_spans():
    assert set(swinging().moments) - set(parameters().moments) == {"swings", "peak_s", "log_span"}
    with pytest.raises(ValueError, match="life spans"):
        Parameters(replace(swinging().frozen(), lifespan=None), torch.ones(12), LearningRates())


def test_surgery_carries_velocities_and_life_spans_along():
    p = swinging()
    one_step(p)
    p.append_children(torch.tensor([3, 7]), {})
    p.keep(torch.arange(14) % 7 != 0)
    now, kept = p.frozen(), [i for i in range(12) if i % 7]
    expected = swinging().frozen()
    for name in ("velocity", "lifespan"):
        torch.testing.assert_close(getattr(now, name)[:-2], getattr(expected, name)[kept])
        torch.testing.assert_close(getattr(now, name)[-2:], getattr(expected, name)[[3, 7]])
    assert p.moments["swings"].mean.shape == (12, 3)
    assert p.moments["log_span"].square.shape == (12,)
    now = p.gaussians()
    (now.velocity.square().sum() + now.lifespan.sum()).backward()
    p.step()
    assert not torch.equal(p.frozen().velocity, expected.velocity)


def densified(gradient: float, log_scale: float, **changes: float) -> Parameters:
    p = parameters()
    with torch.no_grad():
        p.log_scales.fill_(log_scale)
    settings = DensifySettings(every=1, start=0, stop=1, **changes)
    densifier = GradientDensifier(settings, len(p), (10.0, 10.0))
    pull = torch.zeros(len(p), 2)
    pull[:3, 0] = gradient
    densifier.observe(None, pull, torch.ones(len(p), dtype=torch.bool))
    densifier.update(p, 1, 10, torch.Generator().manual_seed(0))
    return p


def test_pull_on_some_rows_is_theirs_alone():
    p = parameters()
    densifier = GradientDensifier(DensifySettings(every=1, start=0, stop=1, gradient=4.0), len(p), (3.0, 4.0))
    seen = torch.tensor([True, True, False])
    # Per half image: (3, 4) and so 5 a row, of which row 7 is seen twice and row 2 is not.
    densifier.observe(torch.tensor([7, 4, 2]), torch.ones(3, 2), seen)
    densifier.observe(torch.tensor([7]), torch.zeros(1, 2), torch.ones(1, dtype=torch.bool))
    densifier.update(p, 1, 10, torch.Generator())
    assert p.frozen().source_frame.tolist() == [*(torch.arange(12) % 5).tolist(), 2, 4]


def test_small_ones_that_want_to_move_are_cloned():
    assert len(densified(gradient=1.0, log_scale=-3.0)) == 15


def test_large_ones_are_split_in_two_and_removed():
    p = densified(gradient=1.0, log_scale=0.0)
    assert len(p) == 12 - 3 + 6
    children = p.frozen().log_scales[-6:]
    torch.testing.assert_close(children, torch.full_like(children, -float(torch.tensor(1.6).log())))


def test_growth_stops_at_the_cap():
    assert len(densified(gradient=1.0, log_scale=-3.0, most=13)) == 13


def test_nothing_grows_below_the_threshold():
    assert len(densified(gradient=1e-6, log_scale=-3.0)) == 12


def test_transparent_ones_are_pruned():
    assert len(densified(gradient=0.0, log_scale=-3.0, prune_opacity=0.6)) == 0


def test_steps_settle_late_and_those_of_positions_all_along() -> None:
    rates = LearningRates()
    assert rates.shares(0.0) == (1.0, 1.0)
    assert rates.shares(rates.settle_after)[1] == 1.0
    assert rates.shares(1.0) == pytest.approx((rates.offsets_end / rates.offsets, rates.settled))

    def moved(done: float) -> torch.Tensor:
        p = parameters()
        before = p.log_scales.detach().clone()
        p.set_progress(done)
        one_step(p)
        return (p.log_scales.detach() - before).abs().mean()

    assert moved(1.0).item() == pytest.approx(rates.settled * moved(0.0).item(), rel=1e-3)
