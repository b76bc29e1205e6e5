"""Adam on all threads against torch.optim.Adam."""

import pytest
import torch

from dreamdrive.fit.adam import Moments, adam_step
from dreamdrive.splat import set_threads, threads

SHAPES = {"offsets": (2001, 3), "logits": (2001,), "sh": (2001, 4, 3), "one": (1, 1), "none": (0, 3)}
RATES = {
    "offsets": [0.02],
    "logits": [0.03],
    "sh": [4e-3] * 3 + [2.5e-4] * 9,
    "one": [0.5],
    "none": [0.1],
}


def some(seed: int, shape: tuple[int, ...]) -> torch.Tensor:
    """Numbers over many orders of magnitude, some of them zero."""
    generator = torch.Generator().manual_seed(seed)
    size = torch.exp(6 * torch.randn(shape, generator=generator) - 6)
    return size * torch.randn(shape, generator=generator) * (torch.rand(shape, generator=generator) > 0.2)


def leaves() -> dict[str, torch.Tensor]:
    return {name: some(0, shape).requires_grad_() for name, shape in SHAPES.items()}


def moments(of: dict[str, torch.Tensor]) -> dict[str, Moments]:
    return {name: Moments(torch.zeros_like(leaf), torch.zeros_like(leaf)) for name, leaf in of.items()}


def run(steps: int) -> tuple[dict[str, torch.Tensor], dict[str, Moments]]:
    ours = leaves()
    memory = moments(ours)
    for step in range(steps):
        for name, leaf in ours.items():
            leaf.grad = some(step + 1, SHAPES[name])
        adam_step(ours, memory, RATES)
    return ours, memory


def test_steps_are_those_of_torch() -> None:
    ours, memory = run(7)
    for name, start in leaves().items():
        columns = start.detach().flatten(1) if start.ndim > 1 else start.detach()[:, None]
        rates = (RATES[name] * columns.shape[1])[: columns.shape[1]]
        split = [column.clone().requires_grad_() for column in columns.unbind(1)]
        groups = [{"params": [column], "lr": rate} for column, rate in zip(split, rates, strict=True)]
        theirs = torch.optim.Adam(groups, eps=1e-15)
        for step in range(7):
            gradient = some(step + 1, SHAPES[name]).reshape(columns.shape)
            for column, values in zip(split, gradient.unbind(1), strict=True):
                column.grad = values.clone()
            theirs.step()
        expected = torch.stack(split, 1).detach().reshape(start.shape)
        torch.testing.assert_close(ours[name].detach(), expected, rtol=1e-5, atol=1e-6)
        squares = torch.stack([theirs.state[column]["exp_avg_sq"] for column in split], 1)
        torch.testing.assert_close(memory[name].square, squares.reshape(start.shape), rtol=1e-5, atol=0)
        assert memory[name].steps == 7


def test_a_leaf_without_gradient_stays_and_its_steps_are_not_counted() -> None:
    ours = leaves()
    memory = moments(ours)
    ours["logits"].grad = torch.ones(SHAPES["logits"])
    adam_step(ours, memory, RATES)
    torch.testing.assert_close(ours["logits"].detach(), leaves()["logits"].detach() - 0.03, rtol=0, atol=1e-5)
    assert torch.equal(ours["offsets"], leaves()["offsets"])
    assert [memory[name].steps for name in ("logits", "offsets")] == [1, 0]
    assert ours["logits"].grad is None


def test_torch_notices_that_a_leaf_was_changed() -> None:
    leaf = torch.ones(3, requires_grad=True)
    square = (leaf * leaf).sum()
    leaf.grad = torch.ones(3)
    adam_step({"leaf": leaf}, moments({"leaf": leaf}), {"leaf": [0.1]})
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        square.backward()


def test_thread_count_changes_no_bit() -> None:
    before, results = threads(), []
    try:
        for count in (1, 2, 3):
            set_threads(count)
            results.append(run(3)[0])
    finally:
        set_threads(before)
    for other in results[1:]:
        assert all(torch.equal(results[0][name], other[name]) for name in SHAPES)


@pytest.mark.parametrize("steps", [1, 7])
def test_torch_takes_the_same_steps_where_the_core_does_not(steps: int) -> None:
    ours, _ = run(steps)
    double = {name: leaf.detach().double().requires_grad_() for name, leaf in leaves().items()}
    memory = moments(double)
    for step in range(steps):
        for name, leaf in double.items():
            leaf.grad = some(step + 1, SHAPES[name]).double()
        adam_step(double, memory, RATES)
    for name, leaf in double.items():
        torch.testing.assert_close(ours[name].detach().double(), leaf.detach(), rtol=1e-5, atol=1e-6)
        assert leaf.grad is None


def test_rates_that_do_not_fit_are_refused() -> None:
    leaf = torch.ones(4, requires_grad=True)
    leaf.grad = torch.ones(4)
    with pytest.raises(ValueError, match="rates"):
        adam_step({"leaf": leaf}, moments({"leaf": leaf}), {"leaf": [0.1] * 3})
