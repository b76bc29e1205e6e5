"""The deformation of float32 Gaussians in the compiled core; ``deformation`` says what it computes."""

from typing import Any

import torch
from jaxtyping import Float, Int
from torch import Tensor
from torch.autograd.function import once_differentiable

from dreamdrive import _native


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

    Args:
        means: Canonical centres in metres.
        centre_m: Centre of the domain.
        radius_m: Radius of the domain.
        time_code: The encoded time.
        octaves: Frequencies of the positions' encoding.
        depth: Number of hidden layers.
        skip: Which of them reads the encoding again.
        weights: Weight and bias of each hidden layer, then of the heads of mean, quaternion and log-scale.
    """
    shape = (depth, -1 if skip is None else skip)
    encoding = (centre_m, radius_m, octaves, time_code)
    return _EncodedNetwork.apply(means.detach(), shape, encoding, *weights)  # pyright: ignore[reportReturnType]


class _EncodedNetwork(torch.autograd.Function):
    """Keeps nothing between: the backward pass computes it anew, of rows that some gradient arrives at."""

    @staticmethod
    def forward(
        ctx: Any, means: Tensor, shape: tuple[int, int], encoding: tuple[Any, ...], *weights: Tensor
    ) -> Tensor:
        tensors = [w.detach().contiguous() for w in weights]
        network = _native.encoded_network(tensors, *shape, means.contiguous(), *encoding)
        residual = torch.empty(len(means), 10)
        _native.encoded_network_forward(network, residual)
        if any(ctx.needs_input_grad):
            ctx.network = network
            # So that torch notices what was changed in place before backward.
            ctx.save_for_backward(means, *weights)
        return residual

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *upstream: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        gradients = [torch.empty(w.shape) for w in ctx.saved_tensors[1:]]
        _native.encoded_network_backward(ctx.network, upstream[0].detach().contiguous(), gradients)
        return None, None, None, *gradients


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

    Args:
        canonical: Means (N, 3), quaternions (N, 4), log-scales (N, 3) and logits (N,).
        residual: Added to mean, unit quaternion and log-scale.
        lifespan: Centre and deviation in seconds, or None.
        actor: Track that each follows, -1 for none, or None.
        tracks: Translation (A, 3) and yaw (A,) at the time.
        pivot_m: What each track turns about.
        up: Axis of the yaw.
        t_s: Time in seconds.

    Returns:
        Means, quaternions, log-scales and logits at ``t_s``.
    """
    others = (lifespan, actor, pivot_m, up, t_s)
    return _Posed.apply(others, *canonical, residual, *tracks)  # pyright: ignore[reportReturnType]


class _Posed(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, others: tuple[Any, ...], *learned: Tensor) -> tuple[Tensor, ...]:
        means, quaternions, log_scales, logits, residual, translation, yaw = (
            t.detach().contiguous() for t in learned
        )
        lifespan, actor, pivot, up, t_s = others
        pose = _native.pose(
            means,
            quaternions,
            log_scales,
            logits,
            residual,
            lifespan,
            actor,
            translation,
            yaw,
            pivot,
            up,
            t_s,
        )
        out = [torch.empty_like(t) for t in (means, quaternions, log_scales, logits)]
        _native.pose_forward(pose, out[0], out[1], out[2], out[3])
        if any(ctx.needs_input_grad):
            ctx.pose = pose
            ctx.save_for_backward(*learned)  # so that torch notices what was changed in place before backward
        return tuple(out)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *upstream: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        by_means, by_quaternions, by_log_scales, by_logits = (g.detach().contiguous() for g in upstream)
        means, quaternions, _, logits, residual, translation, yaw = (
            torch.empty(t.shape) for t in ctx.saved_tensors
        )
        _native.pose_backward(
            ctx.pose, by_means, by_quaternions, by_log_scales, by_logits,
            means, quaternions, logits, residual, translation, yaw,
        )  # fmt: skip
        return None, means, quaternions, by_log_scales, logits, residual, translation, yaw
