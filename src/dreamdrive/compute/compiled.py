"""Functions of the compiled core that torch can differentiate."""

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

Wanted = tuple[bool, ...]
Gradients = Callable[..., Sequence[Tensor | None]]
"""From the gradients of the outputs to those of the inputs, None for what has none."""


def differentiable(
    compute: Callable[..., tuple[Tensor | tuple[Tensor, ...], Gradients]], *inputs: Tensor | None
) -> Any:
    """The outputs of ``compute``, which torch differentiates once by the gradients that come with them.

    ``compute`` gets the inputs detached and contiguous, and as ``wanted`` which of them want a gradient.
    """
    return _Compiled.apply(compute, *inputs)


def at_once(*gradients: Tensor | None) -> Gradients:
    """Of a number whose gradients cost no more than itself and are found with it."""

    def scaled(upstream: Tensor) -> list[Tensor | None]:
        return [None if each is None else upstream * each for each in gradients]

    return scaled


class _Compiled(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, compute: Any, *inputs: Tensor | None) -> Tensor | tuple[Tensor, ...]:
        wanted = ctx.needs_input_grad[1:]
        plain = [None if value is None else value.detach().contiguous() for value in inputs]
        outputs, gradients = compute(*plain, wanted=wanted)
        if any(wanted):
            ctx.gradients = gradients
            ctx.save_for_backward(*inputs)
        # ``gradients`` may hold the outputs. Torch gets others of the same memory: what it hands out holds
        # ctx, which holds ``gradients``, and no collector sees through torch.
        if isinstance(outputs, Tensor):
            return outputs.detach()
        return tuple(each.detach() for each in outputs)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *upstream: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        _ = ctx.saved_tensors  # raises where one of them was changed in place
        return None, *ctx.gradients(*(gradient.detach().contiguous() for gradient in upstream))
