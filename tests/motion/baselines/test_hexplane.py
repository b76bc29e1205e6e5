"""The feature field of six planes: what it reads, what it moves, gradients, penalties."""

import numpy as np
import pytest
import torch

from dreamdrive import _native
from dreamdrive.motion import Bounds, HexPlaneConfig, HexPlaneField
from dreamdrive.motion.baselines.compiled_hexplane import steepness
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.splat import set_threads, threads
from tests.scene.scenes import gaussians

BOUNDS = Bounds(np.array([-2.0, -1.0, 0.0]), np.array([2.0, 1.0, 10.0]), 1.0, 3.0)
SMALL = HexPlaneConfig(width=4, features=2, resolution=3, levels=2, times=4, coefficients=4)


def field(config: HexPlaneConfig = SMALL) -> HexPlaneField:
    """A field all of whose numbers are random."""
    made = HexPlaneField(config, BOUNDS)
    generator = torch.Generator().manual_seed(5)
    with torch.no_grad():
        for parameter in made.parameters():
            parameter.copy_(torch.rand(parameter.shape, generator=generator))
    return made


def at_node(values: np.ndarray, across: float, down: float) -> np.ndarray:
    """Channels of (C, H, W) at a column and a row, bilinear, clamped."""
    height, width = values.shape[1:]
    x, y = min(max(across, 0), width - 1), min(max(down, 0), height - 1)
    i, j = min(int(x), width - 2), min(int(y), height - 2)
    u, v = x - i, y - j
    top = (1 - u) * values[:, j, i] + u * values[:, j, i + 1]
    return (1 - v) * top + v * ((1 - u) * values[:, j + 1, i] + u * values[:, j + 1, i + 1])


def plain_features(made: HexPlaneField, place: np.ndarray, t_s: float) -> np.ndarray:
    """Features of one place, plane by plane."""
    share = (place - BOUNDS.low_m) / (BOUNDS.high_m - BOUNDS.low_m)
    moment = (t_s - BOUNDS.start_s) / (BOUNDS.end_s - BOUNDS.start_s)
    levels = []
    for space, time in zip(made.space, made.time, strict=True):
        space, time = space.detach().numpy(), time.detach().numpy()
        product = np.ones(space.shape[1])
        for plane, (first, second) in enumerate([(0, 1), (0, 2), (1, 2)]):
            nodes = space.shape[3] - 1
            product *= at_node(space[plane], share[first] * nodes, share[second] * nodes)
        for axis in range(3):
            product *= at_node(time[axis], share[axis] * (time.shape[3] - 1), moment * (time.shape[2] - 1))
        levels.append(product)
    return np.concatenate(levels)


@pytest.mark.parametrize("t_s", [1.0, 1.7, 2.9, 3.0, 0.0, 9.0])
def test_features_are_products_over_planes_level_by_level(t_s: float) -> None:
    made = field().double()
    places = np.random.default_rng(0).uniform([-2.5, -1.2, -1], [2.5, 1.2, 11], (20, 3))
    places[0], places[1] = BOUNDS.low_m, BOUNDS.high_m
    found = made.features(torch.tensor(places), t_s).detach().numpy()
    expected = np.stack([plain_features(made, place, t_s) for place in places])
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_starts_as_the_identity_with_features_of_space_alone() -> None:
    made, before = HexPlaneField(SMALL, BOUNDS), gaussians(5, 0)
    after = made.apply_at(before, 1.4)
    assert all(torch.equal(getattr(after, name), value) for name, value in before.tensors().items())
    features = made.features(before.means, 1.0)
    assert torch.equal(features, made.features(before.means, 2.6))
    assert features.std() > 0


def test_means_and_colours_move_over_time_and_nothing_else_does() -> None:
    made, before = field(), gaussians(5, 0)
    now, later = made.apply_at(before, 1.4), made.apply_at(before, 2.4)
    for name in ("means", "sh"):
        assert not torch.equal(getattr(now, name), getattr(before, name))
        assert not torch.equal(getattr(now, name), getattr(later, name))
    for name in ("quaternions", "log_scales", "logit_opacities"):
        assert torch.equal(getattr(now, name), getattr(before, name))


def test_gradients() -> None:
    made, start = field().double(), gaussians(3, 0)
    start = Gaussians(**{n: v.double() if v.is_floating_point() else v for n, v in start.tensors().items()})
    named = dict(made.named_parameters())

    def moved(*values: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        changed = dict(zip(named, values, strict=True))
        after = torch.func.functional_call(
            _Applied(made), {f"made.{n}": v for n, v in changed.items()}, start
        )
        return after.means, after.sh

    leaves = tuple(p.detach().clone().requires_grad_() for p in named.values())
    assert torch.autograd.gradcheck(moved, leaves)


def moved_with_gradients(made: HexPlaneField, start: Gaussians, t_s: float) -> dict[str, torch.Tensor]:
    """Means and colours at ``t_s``, and the gradients of a random sum of them by the name of a parameter."""
    after = made.apply_at(start, t_s)
    generator = torch.Generator().manual_seed(8)
    total = torch.zeros(())
    for value in (after.means, after.sh):
        weights = torch.randn(value.shape, generator=generator, dtype=torch.float64)
        weights[::3] = 0  # rows that nothing of the picture depends on
        total = total + (value * weights.to(value.dtype)).sum()
    named = dict(made.named_parameters())
    found = torch.autograd.grad(total, list(named.values()))
    return {"means": after.means.detach(), "sh": after.sh.detach(), **dict(zip(named, found, strict=True))}


@pytest.mark.parametrize("count", [1, 64, 131])
@pytest.mark.parametrize(
    "config",
    [SMALL, HexPlaneConfig(times=3), HexPlaneConfig(width=20, features=11, resolution=2, levels=3)],
)
def test_the_compiled_core_agrees_with_plain_torch(config: HexPlaneConfig, count: int) -> None:
    def centred() -> HexPlaneField:
        made = field(config)
        with torch.no_grad():
            for parameter in made.parameters():
                parameter.mul_(2).sub_(0.8)
        return made

    start = gaussians(count, 0)
    double = {name: v.double() if v.is_floating_point() else v for name, v in start.tensors().items()}
    single = moved_with_gradients(centred(), start, 1.9)
    expected = moved_with_gradients(centred().double(), Gaussians(**double), 1.9)
    for name, wanted in expected.items():
        scale = wanted.abs().max().item() + 1e-6
        torch.testing.assert_close(single[name].double(), wanted, rtol=0, atol=2e-5 * scale, msg=name)


def test_thread_count_changes_no_bit() -> None:
    start, before, results = gaussians(5000, 0), threads(), []
    try:
        for count in (1, 2, 3):
            set_threads(count)
            results.append(moved_with_gradients(field(HexPlaneConfig()), start, 1.9))
    finally:
        set_threads(before)
    for other in results[1:]:
        assert all(torch.equal(other[name], value) for name, value in results[0].items())


class _Applied(torch.nn.Module):
    def __init__(self, made: HexPlaneField) -> None:
        super().__init__()
        self.made = made

    def forward(self, start: Gaussians) -> Gaussians:
        return self.made.apply_at(start, 1.9)


def test_canonical_means_get_gradients_through_the_splat_only() -> None:
    means = gaussians(3, 0).means.requires_grad_()
    start = Gaussians(**{**gaussians(3, 0).tensors(), "means": means})
    field().apply_at(start, 1.5).means.sum().backward()
    assert torch.equal(means.grad, torch.ones(3, 3))


def test_the_penalty_adds_up_plane_by_plane() -> None:
    made, before = field(), gaussians(5, 0)
    after = made.apply_at(before, 1.4)
    c = made.config
    offsets = ((getattr(after, name) - getattr(before, name)).detach().abs() for name in ("means", "sh"))
    expected = c.offset_weight * sum(offset.mean().item() for offset in offsets)
    for space, time in zip(made.space, made.time, strict=True):
        for plane in space.detach().numpy().astype(np.float64):
            steps = [np.diff(plane, axis=axis) for axis in (1, 2)]
            expected += c.plane_weight * sum((step**2).mean() for step in steps)
        for plane in time.detach().numpy().astype(np.float64):
            bend = plane[:, 2:] - 2 * plane[:, 1:-1] + plane[:, :-2]
            expected += c.time_weight * (bend**2).mean() + c.unity_weight * np.abs(plane - 1).mean()
    assert made.penalty(before, after).item() == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("nodes", [2, 15, 16, 33])
def test_the_compiled_steepness_agrees_with_plain_torch(nodes: int) -> None:
    generator = torch.Generator().manual_seed(nodes)
    planes = torch.randn(3, 5, nodes, nodes, generator=generator, requires_grad=True)
    double = planes.detach().double().requires_grad_()
    expected = 0.7 * (double.diff(dim=2).square().mean() + double.diff(dim=3).square().mean())
    found = steepness(planes, 0.7)
    assert found.item() == pytest.approx(expected.item(), rel=1e-6)
    (gradient,) = torch.autograd.grad(3 * found, planes)
    (wanted,) = torch.autograd.grad(3 * expected, double)
    torch.testing.assert_close(gradient.double(), wanted, rtol=0, atol=1e-6 * wanted.abs().max().item())


def test_places_that_are_no_number_read_and_write_the_border() -> None:
    means = torch.full((2, 3), torch.nan)
    means[1] = torch.inf
    features = field().features(means, 1.5)
    features.sum().backward()
    assert torch.isfinite(features).all()


def test_the_core_refuses_what_does_not_fit() -> None:
    low, high, means = torch.zeros(3), torch.ones(3), torch.zeros(2, 3)
    space, lines = [torch.zeros(3, 2, 4, 4)], [torch.zeros(3, 2, 4)]
    with pytest.raises(ValueError, match="each level"):
        _native.planes(space, [], means, low, high)
    with pytest.raises(ValueError, match="lines"):
        _native.planes(space, [torch.zeros(3, 2, 3)], means, low, high)
    planes = _native.planes(space, lines, means, low, high)
    with pytest.raises(ValueError, match="features"):
        _native.planes_forward(planes, torch.zeros(3))
    with pytest.raises(ValueError, match="d_space"):
        _native.planes_backward(planes, torch.zeros(2, 2), [torch.zeros(3)], lines)
    with pytest.raises(ValueError, match="images"):
        _native.steepness(torch.zeros(2, 3), 1.0, None)


def test_two_nodes_along_time_have_no_curvature_to_punish() -> None:
    made, before = field(HexPlaneConfig(features=1, resolution=2, levels=1)), gaussians(2, 0)
    assert torch.isfinite(made.penalty(before, made.apply_at(before, 2.0)))


def test_each_parameter_learns_at_one_rate() -> None:
    made = field()
    groups = made.groups()
    assert {id(p) for p in groups["planes"]} == {id(p) for p in (*made.space, *made.time)}
    together = [id(p) for learned in groups.values() for p in learned]
    assert sorted(together) == sorted(id(p) for p in made.parameters())


def test_a_seed_gives_the_same_field_and_leaves_the_generator_alone() -> None:
    torch.manual_seed(3)
    expected = torch.rand(1)
    torch.manual_seed(3)
    one, two, other = (HexPlaneField(SMALL, BOUNDS, seed) for seed in (1, 1, 2))
    assert torch.equal(torch.rand(1), expected)
    assert torch.equal(one.space[0], two.space[0])
    assert not torch.equal(one.space[0], other.space[0])


def test_nothing_moves_nothing() -> None:
    assert len(field().apply_at(gaussians(0, 0), 1.5)) == 0


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="coefficients"):
        field(HexPlaneConfig(coefficients=9)).apply_at(gaussians(2, 0), 1.5)
    with pytest.raises(ValueError, match="two nodes"):
        HexPlaneConfig(times=1)
    with pytest.raises(ValueError, match="empty box"):
        Bounds(np.zeros(3), np.array([1.0, 0.0, 1.0]), 0.0, 1.0)
