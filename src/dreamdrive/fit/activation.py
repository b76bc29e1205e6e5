"""Activations: from the parameters a fit learns to those that splatting takes."""

from dataclasses import dataclass
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive import _native
from dreamdrive.compute.compiled import Gradients, Wanted, differentiable
from dreamdrive.compute.device import in_core
from dreamdrive.fit.parameters import Parameters
from dreamdrive.scene.gaussians import Gaussians

# Of one part, in the order of the arguments of _activated.
_TENSORS = ("means", "unit_m", "offsets", "quaternions", "log_scales", "logit_opacities", "sh")


@dataclass(frozen=True)
class Activated:
    """Gaussians as ``rasterize`` takes them.

    Attributes:
        means: Centres (N, 3) in metres.
        quaternions: Rotations (N, 4), wxyz, of any length.
        scales: Standard deviations (N, 3) in metres.
        opacities: In [0, 1] (N,).
        sh: Spherical-harmonic colour (N, K, 3).
    """

    means: Float[Tensor, "n 3"]
    quaternions: Float[Tensor, "n 4"]
    scales: Float[Tensor, "n 3"]
    opacities: Float[Tensor, " n"]
    sh: Float[Tensor, "n k 3"]


def activate(static: Parameters | None, moved: Gaussians | None) -> Activated:
    """Exponential of log-scales, sigmoid of logits, positions in metres: the static part, then the moved one.

    Args:
        static: Gaussians free of time, or None.
        moved: Dynamic Gaussians as they are at the time, without life spans, or None.
    """
    present = [part for part in (static, moved) if part is not None]
    if not in_core(present[0].sh):
        now = [part.gaussians() if isinstance(part, Parameters) else part for part in present]
        every = Gaussians.concatenate(*(part.without_features() for part in now))
        scales, opacities = every.log_scales.exp(), every.logit_opacities.sigmoid()
        return Activated(every.means, every.quaternions, scales, opacities, every.sh)
    tensors: list[Tensor | None] = []
    if static is not None:
        tensors += [static.anchors, *(getattr(static, name) for name in _TENSORS[1:])]
    if moved is not None:
        tensors += [getattr(moved, name, None) for name in _TENSORS]
    return Activated(*differentiable(_activated, *tensors))


def _activated(*tensors: Tensor | None, wanted: Wanted) -> tuple[tuple[Tensor, ...], Gradients]:
    """From the tensors of ``_TENSORS`` of one or two parts to those of ``Activated`` for all of them.

    The means are ``means + unit_m * offsets``, of which only the offsets get a gradient, or as given.
    """
    parts: list[Any] = [tensors[k : k + len(_TENSORS)] for k in range(0, len(tensors), len(_TENSORS))]
    counts, coefficients = [len(part[0]) for part in parts], parts[0][-1].shape[1]
    starts = [sum(counts[:k]) for k in range(len(counts))]
    tails = ((3,), (4,), (3,), (), (coefficients, 3))
    means, quaternions, scales, opacities, sh = (torch.empty(sum(counts), *tail) for tail in tails)
    for (base, unit, offsets, q, log_scales, logits, colour), start in zip(parts, starts, strict=True):
        _native.activate(
            base, unit, offsets, q, log_scales, logits, colour, start,
            means, quaternions, scales, opacities, sh,
        )  # fmt: skip

    def gradients(*upstream: Tensor) -> list[Tensor | None]:
        d_means, d_quaternions, d_scales, d_opacities, d_sh = upstream
        found: list[Tensor | None] = []
        for (_, unit, *_), start, count in zip(parts, starts, counts, strict=True):
            rows = slice(start, start + count)
            d_offsets = None if unit is None else torch.empty(count, 3)
            d_log_scales, d_logits = torch.empty(count, 3), torch.empty(count)
            _native.activate_backward(
                unit, start, scales, opacities, d_means, d_scales, d_opacities,
                d_offsets, d_log_scales, d_logits,
            )  # fmt: skip
            found += [d_means[rows] if unit is None else None, None, d_offsets]
            found += [d_quaternions[rows], d_log_scales, d_logits, d_sh[rows]]
        return found

    return (means, quaternions, scales, opacities, sh), gradients
