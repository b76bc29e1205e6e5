"""Planes and decoder of float32 Gaussians in the compiled core; ``hexplane`` says what they compute."""

from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor
from torch.autograd.function import once_differentiable

from dreamdrive import _native


def plane_features(
    means: Float[Tensor, "n 3"],
    low_m: Float[Tensor, "3"],
    high_m: Float[Tensor, "3"],
    space: list[Tensor],
    lines: list[Tensor],
) -> Float[Tensor, "n f"]:
    """Products over six planes, level by level; differentiable in planes and lines alone.

    Args:
        means: Canonical centres in metres.
        low_m: Least corner of the box.
        high_m: Its greatest corner.
        space: Planes xy, xz, yz of each level, (3, C, R, R), the first named axis last.
        lines: Planes xt, yt, zt of each level at the time, (3, C, R).
    """
    return _Planes.apply(means.detach(), (low_m, high_m), *space, *lines)  # pyright: ignore[reportReturnType]


class _Planes(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, means: Tensor, box: tuple[Tensor, Tensor], *learned: Tensor) -> Tensor:
        tensors = [t.detach().contiguous() for t in learned]
        levels, channels = len(tensors) // 2, tensors[0].shape[1]
        planes = _native.planes(tensors[:levels], tensors[levels:], means.contiguous(), *box)
        features = torch.empty(len(means), levels * channels)
        _native.planes_forward(planes, features)
        if any(ctx.needs_input_grad):
            ctx.planes = planes
            # So that torch notices what was changed in place before backward.
            ctx.save_for_backward(means, *learned)
        return features

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *upstream: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        gradients = [torch.empty(t.shape) for t in ctx.saved_tensors[1:]]
        levels = len(gradients) // 2
        _native.planes_backward(
            ctx.planes, upstream[0].detach().contiguous(), gradients[:levels], gradients[levels:]
        )
        return None, None, *gradients


def dense_network(inputs: Float[Tensor, "n i"], depth: int, weights: list[Tensor]) -> Float[Tensor, "n o"]:
    """Dense layers with ReLU, then heads without, side by side; differentiable in inputs and weights.

    Args:
        inputs: What the first layer reads.
        depth: Number of layers before the heads; all but the last of them equally wide.
        weights: Weight and bias of each layer, then of each head.
    """
    return _DenseNetwork.apply(inputs, depth, *weights)  # pyright: ignore[reportReturnType]


class _DenseNetwork(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, inputs: Tensor, depth: int, *weights: Tensor) -> Tensor:
        network = _native.dense_network([w.detach().contiguous() for w in weights], depth)
        out = torch.empty(len(inputs), sum(len(bias) for bias in weights[2 * depth + 1 :: 2]))
        _native.dense_network_forward(network, inputs.detach().contiguous(), out)
        if any(ctx.needs_input_grad):
            ctx.network = network
            ctx.save_for_backward(inputs, *weights)
        return out

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *upstream: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        inputs, *weights = ctx.saved_tensors
        by_inputs, gradients = torch.empty(inputs.shape), [torch.empty(w.shape) for w in weights]
        _native.dense_network_backward(
            ctx.network, inputs.contiguous(), upstream[0].detach().contiguous(), by_inputs, gradients
        )
        return by_inputs, None, *gradients


def steepness(planes: Float[Tensor, "*c r r"], weight: float) -> Float[Tensor, ""]:
    """``weight`` times the mean squared difference of neighbours along columns, plus that along rows."""
    return _Steepness.apply(planes, weight)  # pyright: ignore[reportReturnType]


class _Steepness(torch.autograd.Function):
    """The gradient costs no more than the value and is kept in its place."""

    @staticmethod
    def forward(ctx: Any, planes: Tensor, weight: float) -> Tensor:
        gradient = torch.empty(planes.shape) if any(ctx.needs_input_grad) else None
        value = _native.steepness(planes.detach().contiguous(), weight, gradient)
        ctx.save_for_backward(gradient)
        return torch.tensor(value, dtype=torch.float32)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *upstream: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        (gradient,) = ctx.saved_tensors
        return upstream[0] * gradient, None
