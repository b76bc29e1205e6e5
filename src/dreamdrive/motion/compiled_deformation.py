"""The deformation of float32 Gaussians in the compiled core; ``deformation`` says what it computes."""

from functools import partial
from typing import Any

import torch
from jaxtyping import Float, Int
from torch import Tensor

from dreamdrive import _native
from dreamdrive.compute.compiled import Gradients, Wanted, differentiable


def network_residual(
    means: Float[Tensor, "n 3"],
    centre_m: Float[Tensor, "3"],
    radius_m: float,
    time_code: Float[Tensor, " e"],
    octaves: int,
    depth: int,
    skip: int | None,
    weights: list[Tensor],
) -> Float[Tensor, "n 10"]:
    """What the network adds to mean, unit quaternion and log-scale; differentiable in the weights alone.

    Positions are encoded in ``octaves`` frequencies within the domain, of this centre and radius, and then
    comes the encoded time. Layer ``skip`` of the ``depth`` hidden ones reads the encoding again. The weights
    are weight and bias of each hidden layer, then of the heads of mean, quaternion and log-scale.
    """
    shape = (depth, -1 if skip is None else skip)
    encoding = means.detach().contiguous(), centre_m, radius_m, octaves, time_code
    return differentiable(partial(_encoded_network, shape, encoding), *weights)


def _encoded_network(
    shape: tuple[int, int], encoding: tuple[Any, ...], *weights: Tensor, wanted: Wanted
) -> tuple[Tensor, Gradients]:
    """Keeps nothing between: the way back computes it anew, of rows that some gradient arrives at."""
    network = _native.encoded_network(list(weights), *shape, *encoding)
    residual = torch.empty(len(encoding[0]), 10)
    _native.encoded_network_forward(network, residual)

    def gradients(upstream: Tensor) -> list[Tensor]:
        found = [torch.empty(w.shape) for w in weights]
        _native.encoded_network_backward(network, upstream, found)
        return found

    return residual, gradients


def posed(
    canonical: tuple[Tensor, Tensor, Tensor, Tensor],
    residual: Float[Tensor, "n 10"],
    lifespan: Float[Tensor, "n 2"] | None,
    actor: Int[Tensor, " n"] | None,
    tracks: tuple[Float[Tensor, "a 3"], Float[Tensor, " a"]],
    pivot_m: Float[Tensor, "a 3"],
    up: Float[Tensor, "3"],
    t_s: float,
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Gaussians on their tracks, with the residual, faded; differentiable in canonical, residual and tracks.

    ``canonical`` are means (N, 3), quaternions (N, 4), log-scales (N, 3) and logits (N,), as is the result at
    ``t_s``. The residual is added to mean, unit quaternion and log-scale. ``actor`` is the track that each
    follows, -1 for none; ``tracks`` are translation (A, 3) and yaw (A,) about ``up`` and ``pivot_m`` at the
    time; ``lifespan`` is centre and deviation in seconds.
    """
    others = (lifespan, actor, pivot_m, up, t_s)
    return differentiable(partial(_posed, others), *canonical, residual, *tracks)


def _posed(
    others: tuple[Any, ...],
    means: Tensor,
    quaternions: Tensor,
    log_scales: Tensor,
    logits: Tensor,
    residual: Tensor,
    translation: Tensor,
    yaw: Tensor,
    *,
    wanted: Wanted,
) -> tuple[tuple[Tensor, ...], Gradients]:
    canonical = means, quaternions, log_scales, logits
    lifespan, actor, pivot, up, t_s = others
    pose = _native.pose(*canonical, residual, lifespan, actor, translation, yaw, pivot, up, t_s)
    out = tuple(torch.empty_like(t) for t in canonical)
    _native.pose_forward(pose, *out)

    def gradients(*upstream: Tensor) -> tuple[Tensor, ...]:
        learned = means, quaternions, logits, residual, translation, yaw
        found = [torch.empty(t.shape) for t in learned]
        _native.pose_backward(pose, *upstream, *found)
        return *found[:2], upstream[2], *found[2:]  # a log-scale is only added to

    return out, gradients
