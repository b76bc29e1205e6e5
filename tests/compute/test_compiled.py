"""Between the compiled core and torch."""

import weakref

import torch
from torch import Tensor

from dreamdrive.compute.compiled import Gradients, Wanted, differentiable


class _Held:
    """Tells when it is forgotten."""


def _square_root(value: Tensor, wanted: Wanted) -> tuple[Tensor, Gradients]:
    """Its gradient needs the result, as that of many functions does."""
    root, held = value.sqrt(), _Held()
    forgotten.append(weakref.ref(held))

    def gradients(upstream: Tensor) -> list[Tensor | None]:
        return [upstream / (2 * root) if held else None]

    return root, gradients


forgotten: list[weakref.ref[_Held]] = []


def test_what_a_gradient_needs_is_forgotten_with_its_result() -> None:
    value = torch.tensor([4.0, 9.0], requires_grad=True)
    root = differentiable(_square_root, value)
    root.sum().backward()
    torch.testing.assert_close(value.grad, torch.tensor([0.25, 1 / 6]))
    assert forgotten[-1]() is not None
    del root
    assert forgotten[-1]() is None
