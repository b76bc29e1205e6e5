"""The normal equations against differences of the loss they belong to."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.geometry.backends.dust3r.align.graph import graph_of
from dreamdrive.geometry.backends.dust3r.align.normal import ImageSamples, normal_equations
from dreamdrive.geometry.backends.dust3r.align.rays import Cauchy, Distance, Penalty, RayMisses
from dreamdrive.geometry.backends.dust3r.align.samples import draw_samples
from dreamdrive.geometry.backends.dust3r.align.spanning_tree import spanning_tree
from dreamdrive.geometry.backends.dust3r.align.state import Freedom, State
from dreamdrive_bench.geometry.simulated_pairs import Noise, pair_maps
from tests.geometry.backends.dust3r.align.pairs import street, window

_STEPS = 60


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Two threads on tensors this small mostly wait for each other."""
    with one_torch_thread():
        yield


@pytest.fixture(scope="module")
def problem() -> tuple[ImageSamples, State]:
    maps = pair_maps(street(3, 40, 24), np.array([(0, 1), (1, 0), (2, 1)]), Noise(outliers=0))
    start = spanning_tree(maps)
    state = State.of(start.world_from_camera, start.focals_px, start.pairs)
    return draw_samples(maps, graph_of(maps), 30, 0)[1], state


def loss(samples: ImageSamples, state: State, penalty: Penalty, reference: torch.Tensor) -> float:
    """Of one image, at the best depth."""
    misses = samples.misses(state)
    depth = misses.depth(reference, penalty, reference, _STEPS)
    return float(misses.cost(depth, penalty, reference)[0].sum())


def own_part(samples: ImageSamples, state: State, index: int, amount: float) -> State:
    """The state after one of the unknowns of the image's normal equations moved."""
    step = np.zeros(7 * (len(state.centre) + len(state.edge_scale)))
    starts = [7 * samples.image, *(7 * (len(state.centre) + edge) for edge in samples.edges)]
    step[starts[index // 7] + index % 7] = amount
    return state.moved(step)


@pytest.mark.parametrize("penalty", [Distance(0.05), Cauchy(0.2, 1.0), Cauchy(0.2, 3.0)])
def test_the_gradient_is_that_of_the_loss_at_the_best_depth(
    problem: tuple[ImageSamples, State], penalty: Penalty
) -> None:
    samples, state = problem
    middle = samples.misses(state).middle()
    # A relative cost measures by the depth itself: where that has settled, both stand for the same reference.
    for _ in range(20):
        middle = samples.misses(state).depth(middle, penalty, middle, 10)
    gradient = normal_equations(samples, state, middle, penalty)[1].numpy()
    size = 1e-5
    for index in range(0, len(gradient), 2):
        after, before = (
            loss(samples, own_part(samples, state, index, sign * size), penalty, middle) for sign in (1, -1)
        )
        numeric = (after - before) / (2 * size)
        assert gradient[index] == pytest.approx(numeric, rel=2e-3, abs=1e-4 * np.abs(gradient).max())


def test_with_full_bend_shifts_have_newtons_hessian(problem: tuple[ImageSamples, State]) -> None:
    samples, state = problem
    penalty = Distance(0.05)
    depth = samples.misses(state).middle()
    depth = samples.misses(state).depth(depth, penalty, depth, _STEPS)
    bent = normal_equations(samples, state, depth, penalty, bend=1.0)[0].numpy()
    plain = normal_equations(samples, state, depth, penalty, bend=0.0)[0].numpy()
    size = 1e-5
    for index in (3, 4, 5, 10, 11, 12):
        sides = [
            normal_equations(moved, own, deep, penalty)[1].numpy()[index]
            for moved, own, deep in (
                _at(samples, own_part(samples, state, index, sign * size), depth, penalty) for sign in (1, -1)
            )
        ]
        numeric = (sides[0] - sides[1]) / (2 * size)
        assert bent[index, index] == pytest.approx(numeric, rel=0.02)
        assert plain[index, index] >= bent[index, index]
    assert np.linalg.eigvalsh(plain).min() > -1e-9 * np.abs(plain).max()


def _at(
    samples: ImageSamples, state: State, depth: torch.Tensor, penalty: Penalty
) -> tuple[ImageSamples, State, torch.Tensor]:
    return samples, state, samples.misses(state).depth(depth, penalty, depth, _STEPS)


def test_depth_is_the_least_along_each_ray() -> None:
    random = torch.Generator().manual_seed(0)
    rays = torch.cat([torch.randn(30, 2, generator=random), torch.ones(30, 1)], dim=1).double()
    points = 4 * rays + torch.randn(5, 30, 3, generator=random).double()
    weight = torch.rand(5, 30, generator=random).double()
    weight[2] = 0
    misses = RayMisses.of(rays, points, weight)
    penalty = Distance(1e-9)
    found = misses.depth(misses.middle(), penalty, misses.middle(), 400)

    def cost(depth: torch.Tensor) -> torch.Tensor:
        distance = (depth[None, :, None] * rays - points).norm(dim=-1)
        return (weight * distance).sum(dim=0)

    ladder = torch.stack(
        [cost(torch.full((30,), float(z), dtype=torch.float64)) for z in np.linspace(0, 9, 3001)]
    )
    assert (cost(found) <= ladder.min(dim=0).values + 1e-6).all()


def test_what_is_fixed_does_not_move(problem: tuple[ImageSamples, State]) -> None:
    _, state = problem
    images, edges = len(state.centre), len(state.edge_scale)
    free = Freedom("each").basis(state)
    assert free.shape == (7 * (images + edges), 6 * (images - 1) + images + 7 * edges - 1)
    assert Freedom("shared").basis(state).shape[1] == free.shape[1] - images + 1
    assert Freedom(None).basis(state).shape[1] == free.shape[1] - images
    assert Freedom(None, poses=False).basis(state).shape[1] == 7 * edges
    step = free @ np.random.default_rng(0).normal(size=free.shape[1])
    moved = state.moved(0.1 * step)
    np.testing.assert_array_equal(moved.centre[0], state.centre[0])
    assert np.log(moved.edge_scale).mean() == pytest.approx(np.log(state.edge_scale).mean())
    scaled = state.moved(0.1 * (Freedom(None, poses=False).basis(state) @ np.eye(7 * edges)[0]))
    np.testing.assert_allclose(scaled.centre, 1.1 * state.centre)


def test_only_some_pixels_are_drawn_and_they_stand_for_all() -> None:
    truth = street(3, 40, 24)
    maps = pair_maps(truth, window(3), Noise())
    some, every = (draw_samples(maps, graph_of(maps), count, 0) for count in (100, 10_000))
    assert [len(each.pixels) for each in some] == [100] * 3
    assert [len(each.pixels) for each in every] == [int((truth.depth[i] > 0).sum()) for i in range(3)]
    for few, all_of in zip(some, every, strict=True):
        assert float(few.weight.sum()) == pytest.approx(float(all_of.weight.sum()), rel=0.05)
    again = draw_samples(replace(maps), graph_of(maps), 100, 0)
    assert all(torch.equal(a.points, b.points) for a, b in zip(some, again, strict=True))
