"""The deformation field: identity at the start, rigid tracks, life spans, gradients."""

import math
from dataclasses import asdict, replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings, strategies as st

from dreamdrive.motion import (
    DeformationConfig,
    DeformationField,
    Domain,
    Tracks,
    encode,
    multiply_quaternions,
)
from dreamdrive.motion.compiled_deformation import network_residual
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.splat import set_threads, threads

UP = np.array([0.0, -1.0, 0.0])
DOMAIN = Domain(np.array([1.0, 0.0, 20.0]), 8.0, 0.0, 2.0, UP)
TRACKS = Tracks(
    times_s=np.array([0.0, 1.0, 2.0]),
    translation_m=np.array([[[0, 0, 0], [0, 0, 4], [2, 0, 6]], [[1, 0, 0]] * 3], dtype=float),
    yaw_rad=np.array([[0, 0, -math.pi / 2], [0, 0, 0]], dtype=float),
    pivot_m=np.array([[1, 0, 10], [0, 0, 0]], dtype=float),
)


def gaussians(count: int = 9, dtype: torch.dtype = torch.float32, **more: torch.Tensor) -> Gaussians:
    g = torch.Generator().manual_seed(1)

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=g, dtype=dtype)

    return Gaussians(
        means=normal(count, 3),
        quaternions=normal(count, 4),
        log_scales=normal(count, 3),
        logit_opacities=normal(count),
        sh=normal(count, 1, 3),
        source_frame=torch.zeros(count, dtype=torch.int64),
        **more,
    )


def field(tracks: Tracks | None = None, seed: int = 0, **shape: int) -> DeformationField:
    if tracks is not None:
        shape |= {"actors": len(tracks.pivot_m), "track_times": len(tracks.times_s)}
    return DeformationField(DeformationConfig(**shape), DOMAIN, tracks, seed)


def opacity(g: Gaussians) -> torch.Tensor:
    return g.logit_opacities.sigmoid()


def test_starts_as_the_identity() -> None:
    before = gaussians()
    after = field().apply_at(before, 0.7)
    assert torch.equal(after.means, before.means)
    assert torch.equal(after.log_scales, before.log_scales)
    torch.testing.assert_close(after.quaternions, torch.nn.functional.normalize(before.quaternions, dim=-1))


def test_paper_size_feeds_the_input_in_again_in_the_middle() -> None:
    big = field(depth=8, width=256)
    inputs = 3 * 21 + 13
    assert [layer.in_features for layer in big.layers] == [inputs, 256, 256, 256, 256 + inputs, 256, 256, 256]
    assert big.residual(torch.randn(3, 3), 0.5).mean_m.shape == (3, 3)
    assert all(layer.in_features in (inputs, 64) for layer in field().layers)


def test_encoding_is_the_value_then_sines_and_cosines_of_octaves() -> None:
    values = torch.tensor([[0.3, -1.0]])
    encoded = encode(values, 3)
    expected = [0.3, -1.0] + [
        f(2**k * v) for f in (math.sin, math.cos) for k in range(3) for v in (0.3, -1.0)
    ]
    torch.testing.assert_close(encoded[0], torch.tensor(expected))


def test_tracks_move_and_turn_their_actors_only() -> None:
    moved = gaussians(3, actor=torch.tensor([0, 1, -1]))
    start = torch.tensor([[1.0, 0, 12], [5, 0, 0], [5, 5, 5]])
    unit = torch.tensor([[1.0, 0, 0, 0]] * 3)
    moved = Gaussians(**{**moved.tensors(), "means": start, "quaternions": unit})
    at_key = field(TRACKS).apply_at(moved, 1.0).means
    torch.testing.assert_close(at_key, torch.tensor([[1.0, 0, 16], [6, 0, 0], [5, 5, 5]]))
    end = field(TRACKS).apply_at(moved, 2.0)
    # A negative angle about up turns right: two metres ahead of the pivot become two metres to its right.
    torch.testing.assert_close(end.means[0], torch.tensor([1.0 + 2 + 2, 0, 10 + 6]), atol=1e-5, rtol=0)
    half = math.sqrt(0.5)
    torch.testing.assert_close(end.quaternions[0], torch.tensor([half, 0, half, 0]), atol=1e-6, rtol=0)


def test_tracks_go_on_at_the_last_velocity_outside() -> None:
    translation, yaw = field(TRACKS).pose(3.0)
    torch.testing.assert_close(translation[0], torch.tensor([4.0, 0, 8]))
    assert yaw[0].item() == pytest.approx(-math.pi)
    torch.testing.assert_close(field(TRACKS).pose(-0.5)[0][0], torch.tensor([0.0, 0, -2]))


@given(st.floats(-1, 4))
@settings(max_examples=20)
def test_constant_velocity_is_kept_between_and_beyond_uneven_key_frames(t_s: float) -> None:
    times_s = np.array([0.0, 0.3, 1.0, 2.0])
    even = Tracks(
        times_s, times_s[None, :, None] * np.array([2.0, 0, -3]), 0.5 * times_s[None], np.zeros((1, 3))
    )
    translation, yaw = field(even).pose(t_s)
    torch.testing.assert_close(translation[0], t_s * torch.tensor([2.0, 0, -3]), atol=1e-5, rtol=0)
    assert yaw[0].item() == pytest.approx(0.5 * t_s, abs=1e-5)


def test_one_key_frame_is_a_standing_offset() -> None:
    one = Tracks(np.array([0.0]), np.ones((1, 1, 3)), np.zeros((1, 1)), np.zeros((1, 3)))
    moved = field(one).apply_at(gaussians(2, actor=torch.zeros(2, dtype=torch.int64)), 5.0)
    torch.testing.assert_close(moved.means, gaussians(2).means + 1)


@given(
    st.floats(-12, 12), st.floats(0, 5), st.floats(0.05, 10), st.sampled_from([torch.float32, torch.float64])
)
@settings(max_examples=60)
def test_fading_multiplies_the_opacity(
    logit: float, away_s: float, deviation_s: float, dtype: torch.dtype
) -> None:
    one = gaussians(1, dtype, lifespan=torch.tensor([[1.0, deviation_s]], dtype=dtype))
    one = Gaussians(**{**one.tensors(), "logit_opacities": torch.tensor([logit], dtype=dtype)})
    after = one.faded_at(1.0 + away_s)
    expected = opacity(one) * math.exp(-(away_s**2) / (2 * deviation_s**2))
    torch.testing.assert_close(opacity(after), expected, atol=2e-6, rtol=2e-5)
    assert after.lifespan is None


def test_fading_is_finite_at_extremes_with_finite_gradients() -> None:
    logits = torch.tensor([-200.0, -80, 0, 80, 200], requires_grad=True)
    for away_s in (0.0, 1e-4, 0.1, 5.0, 1000.0):
        one = gaussians(5, lifespan=torch.tensor([[0.0, 0.01]] * 5))
        after = replace(one, logit_opacities=logits).faded_at(away_s)
        assert torch.isfinite(after.logit_opacities).all()
        (gradient,) = torch.autograd.grad(opacity(after).sum(), logits)
        assert torch.isfinite(gradient).all()
    at_peak = replace(one, logit_opacities=logits[:4].repeat(2)[:5]).faded_at(0.0)
    torch.testing.assert_close(at_peak.logit_opacities[:4], logits[:4].detach())


def test_gradients_are_right() -> None:
    deformation = field(TRACKS, depth=2, width=6, position_frequencies=2, time_frequencies=2).double()
    for head in (deformation.head_mean, deformation.head_quaternion, deformation.head_log_scale):
        torch.nn.init.normal_(head.weight, std=0.3, generator=torch.Generator().manual_seed(3))
    start = gaussians(4, torch.float64, actor=torch.tensor([0, 1, -1, 0]))
    lifespan = torch.tensor([[0.2, 0.7]] * 4, dtype=torch.float64)

    def run(quaternions, log_scales, logits, lifespan, translation, yaw, weight):
        named = {"track_translation": translation, "track_yaw_rad": yaw, "head_mean.weight": weight}
        g = Gaussians(
            start.means,
            quaternions,
            log_scales,
            logits,
            start.sh,
            start.source_frame,
            None,
            lifespan,
            start.actor,
        )
        moved = _Applied(deformation)
        out = torch.func.functional_call(moved, {f"field.{k}": v for k, v in named.items()}, (g, 0.6))
        return out.means, out.quaternions, out.log_scales, out.logit_opacities

    inputs = [
        *(start.quaternions, start.log_scales, start.logit_opacities, lifespan),
        *(deformation.track_translation, deformation.track_yaw_rad, deformation.head_mean.weight),
    ]
    assert torch.autograd.gradcheck(run, [i.detach().clone().requires_grad_() for i in inputs])


class _Applied(torch.nn.Module):
    def __init__(self, inner: DeformationField) -> None:
        super().__init__()
        self.field = inner

    def forward(self, g: Gaussians, t_s: float) -> Gaussians:
        return self.field.apply_at(g, t_s)


def test_the_network_sees_detached_means_but_tracks_turn_their_gradient() -> None:
    deformation = field(TRACKS)
    torch.nn.init.normal_(deformation.head_mean.weight, generator=torch.Generator().manual_seed(0))
    means = gaussians(3).means.requires_grad_()
    g = Gaussians(**{**gaussians(3, actor=torch.tensor([0, 0, -1])).tensors(), "means": means})
    (gradient,) = torch.autograd.grad(deformation.apply_at(g, 2.0).means[:, 0].sum(), means)
    # x after a quarter turn to the right is z before it.
    torch.testing.assert_close(gradient, torch.tensor([[0.0, 0, 1], [0, 0, 1], [1, 0, 0]]), atol=1e-6, rtol=0)


def test_equal_seeds_give_equal_fields_and_leave_the_global_generator_alone() -> None:
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    first, second = field(seed=3), field(seed=3)
    assert torch.equal(torch.rand(1), expected)
    assert all(torch.equal(a, b) for a, b in zip(first.parameters(), second.parameters(), strict=True))
    assert not torch.equal(field(seed=4).layers[0].weight, first.layers[0].weight)


def test_a_field_is_rebuilt_from_its_config_and_state() -> None:
    before = field(TRACKS, depth=6, width=8)
    torch.nn.init.normal_(before.head_mean.weight)
    rebuilt = DeformationField(DeformationConfig(**asdict(before.config)), DOMAIN, TRACKS, seed=9)
    rebuilt.load_state_dict(before.state_dict())
    g = gaussians(actor=torch.arange(9) % 3 - 1)
    assert torch.equal(rebuilt.apply_at(g, 1.2).means, before.apply_at(g, 1.2).means)


def test_no_gaussians_is_fine() -> None:
    assert len(field(TRACKS).apply_at(gaussians(0), 1.0)) == 0


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match="tracks of shape"):
        DeformationField(DeformationConfig(), DOMAIN, TRACKS)
    with pytest.raises(ValueError, match="key frames"):
        DeformationConfig(actors=2)
    with pytest.raises(ValueError, match="empty domain"):
        Domain(np.zeros(3), 0.0, 0.0, 1.0, UP)
    with pytest.raises(ValueError, match="unit vector"):
        Domain(np.zeros(3), 1.0, 0.0, 1.0, 2 * UP)


@given(st.lists(st.floats(-1, 1), min_size=8, max_size=8))
@settings(max_examples=30)
def test_quaternion_product_composes_rotations(numbers: list[float]) -> None:
    from scipy.spatial.transform import Rotation

    a, b = np.array(numbers).reshape(2, 4) + np.array([2.0, 0, 0, 0])
    product = multiply_quaternions(torch.tensor(a), torch.tensor(b)).numpy()

    def rotation(q: np.ndarray) -> Rotation:
        return Rotation.from_quat(q[[1, 2, 3, 0]])

    np.testing.assert_allclose(
        rotation(product).as_matrix(), (rotation(a) * rotation(b)).as_matrix(), atol=1e-9
    )


LEARNED = ("means", "quaternions", "log_scales", "logit_opacities")


def moved_with_gradients(
    deformation: DeformationField, start: Gaussians, t_s: float
) -> dict[str, torch.Tensor]:
    """Values at ``t_s`` by name, and the gradients of a random sum of them."""
    leaves = {name: getattr(start, name).clone().requires_grad_() for name in LEARNED}
    after = deformation.apply_at(Gaussians(**start.tensors() | leaves), t_s)
    generator = torch.Generator().manual_seed(8)
    weights = {
        n: torch.randn(getattr(after, n).shape, generator=generator, dtype=torch.float64) for n in LEARNED
    }
    for weight in weights.values():
        weight[1::3] = 0  # out of sight: the compiled core passes over them
    total = sum((getattr(after, n) * weights[n].to(after.means.dtype)).sum() for n in LEARNED)
    named = leaves | dict(deformation.named_parameters())
    found = torch.autograd.grad(total, list(named.values()), allow_unused=True)
    values = {f"value of {n}": getattr(after, n).detach() for n in LEARNED}
    return values | {n: g for n, g in zip(named, found, strict=True) if g is not None}


def woken(deformation: DeformationField) -> DeformationField:
    """The field with heads that do something."""
    generator = torch.Generator().manual_seed(3)
    for head in (deformation.head_mean, deformation.head_quaternion, deformation.head_log_scale):
        torch.nn.init.normal_(head.weight, std=0.3, generator=generator)
        torch.nn.init.normal_(head.bias, std=0.3, generator=generator)
    return deformation


@pytest.mark.parametrize(
    ("tracks", "shape"),
    [
        (TRACKS, {}),
        (None, {"depth": 1, "width": 5, "position_frequencies": 0, "time_frequencies": 0}),
        (TRACKS, {"depth": 6, "width": 20, "position_frequencies": 4}),
        (None, {"depth": 7, "width": 40}),
    ],
)
@pytest.mark.parametrize("count", [1, 64, 131, 300])
def test_the_compiled_core_agrees_with_plain_torch(
    tracks: Tracks | None, shape: dict[str, int], count: int
) -> None:
    generator = torch.Generator().manual_seed(count)
    more = {
        "actor": torch.arange(count) % 3 - 1,
        "lifespan": torch.rand(count, 2, generator=generator) + torch.tensor([0.0, 0.3]),
    }
    start = gaussians(count, torch.float32, **more if tracks is not None else {})
    single = moved_with_gradients(woken(field(tracks, **shape)), start, 0.6)
    double = {name: v.double() if v.is_floating_point() else v for name, v in start.tensors().items()}
    expected = moved_with_gradients(woken(field(tracks, **shape)).double(), Gaussians(**double), 0.6)
    for name, wanted in expected.items():
        scale = wanted.abs().max().item() + 1e-6
        torch.testing.assert_close(single[name].double(), wanted, rtol=0, atol=2e-5 * scale, msg=name)


def test_the_compiled_encoding_is_exact_far_out() -> None:
    """One layer that adds up the encoding: sines and cosines of angles up to ten thousand."""
    means = torch.linspace(-19, 19, 501)[:, None] * torch.tensor([1.0, 0.7, -0.3])
    weights = [torch.eye(63), torch.full((63,), 2.0)]
    found = []
    for rows in torch.eye(63).split(10):
        head = torch.cat([rows, torch.zeros(10 - len(rows), 63)])
        parts = [tensor for part in head.split([3, 4, 3]) for tensor in (part, torch.zeros(len(part)))]
        found.append(
            network_residual(means, torch.zeros(3), 1.0, torch.zeros(0), 10, 1, None, [*weights, *parts])
        )
    encoded = encode(means.double(), 10)
    # ReLU lets the value, between -19 and 19, through from -2 on.
    expected = torch.relu(encoded + 2)
    torch.testing.assert_close(torch.cat(found, 1)[:, :63].double(), expected, rtol=0, atol=2e-6)


def test_thread_count_changes_no_bit_of_the_deformation() -> None:
    start = gaussians(3000, actor=torch.arange(3000) % 3 - 1)
    before, results = threads(), []
    try:
        for count in (1, 2, 3):
            set_threads(count)
            results.append(moved_with_gradients(woken(field(TRACKS)), start, 0.6))
    finally:
        set_threads(before)
    for other in results[1:]:
        assert all(torch.equal(results[0][name], other[name]) for name in results[0])


def test_without_gradients_the_values_are_the_same() -> None:
    deformation, start = woken(field(TRACKS)), gaussians(100, actor=torch.arange(100) % 3 - 1)
    with torch.no_grad():
        quiet = deformation.apply_at(start, 1.2)
    assert torch.equal(quiet.means, deformation.apply_at(start, 1.2).means)


def test_life_spans_with_gradients_need_float64() -> None:
    learned = gaussians(2, lifespan=torch.ones(2, 2, requires_grad=True))
    with pytest.raises(ValueError, match="lifespan"):
        field().apply_at(learned, 0.5)


def test_an_actor_without_a_track_is_refused() -> None:
    with pytest.raises(ValueError, match="actor"):
        field(TRACKS).apply_at(gaussians(2, actor=torch.tensor([0, 2])), 0.5)
