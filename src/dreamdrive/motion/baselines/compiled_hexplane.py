"""Planes and decoder of float32 Gaussians in the compiled core; ``hexplane`` says what they compute."""

from functools import partial

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive import _native
from dreamdrive.compute.compiled import Gradients, Wanted, at_once, differentiable


def plane_features(
    means: Float[Tensor, "n 3"],
    low_m: Float[Tensor, "3"],
    high_m: Float[Tensor, "3"],
    space: list[Tensor],
    lines: list[Tensor],
) -> Float[Tensor, "n f"]:
    """Products over six planes, level by level; differentiable in planes and lines alone.

    ``space`` holds the planes xy, xz, yz of each level, (3, C, R, R), the first named axis last; ``lines``
    those of xt, yt, zt at the time, (3, C, R). The box is from ``low_m`` to ``high_m``.
    """
    return differentiable(partial(_products, means, low_m, high_m), *space, *lines)


def _products(
    means: Tensor, low_m: Tensor, high_m: Tensor, *learned: Tensor, wanted: Wanted
) -> tuple[Tensor, Gradients]:
    levels = len(learned) // 2
    box = means.detach().contiguous(), low_m, high_m
    planes = _native.planes(list(learned[:levels]), list(learned[levels:]), *box)
    features = torch.empty(len(means), levels * learned[0].shape[1])
    _native.planes_forward(planes, features)

    def gradients(upstream: Tensor) -> list[Tensor]:
        found = [torch.empty(t.shape) for t in learned]
        _native.planes_backward(planes, upstream, found[:levels], found[levels:])
        return found

    return features, gradients


def dense_network(inputs: Float[Tensor, "n i"], depth: int, weights: list[Tensor]) -> Float[Tensor, "n o"]:
    """Dense layers with ReLU, then heads without, side by side; differentiable in inputs and weights.

    ``depth`` is the number of layers before the heads, all but the last of them equally wide; ``weights`` are
    weight and bias of each layer, then of each head.
    """
    return differentiable(partial(_dense, depth), inputs, *weights)


def _dense(depth: int, inputs: Tensor, *weights: Tensor, wanted: Wanted) -> tuple[Tensor, Gradients]:
    network = _native.dense_network(list(weights), depth)
    out = torch.empty(len(inputs), sum(len(bias) for bias in weights[2 * depth + 1 :: 2]))
    _native.dense_network_forward(network, inputs, out)

    def gradients(upstream: Tensor) -> list[Tensor]:
        found = [torch.empty(t.shape) for t in (inputs, *weights)]
        _native.dense_network_backward(network, inputs, upstream, found[0], found[1:])
        return found

    return out, gradients


def steepness(planes: Float[Tensor, "*c r r"], weight: float) -> Float[Tensor, ""]:
    """``weight`` times the mean squared difference of neighbours along columns, plus that along rows."""
    return differentiable(partial(_squares, weight), planes)


def _squares(weight: float, planes: Tensor, *, wanted: Wanted) -> tuple[Tensor, Gradients]:
    gradient = torch.empty(planes.shape) if wanted[0] else None
    value = _native.steepness(planes, weight, gradient)
    return torch.tensor(value, dtype=torch.float32), at_once(gradient)
