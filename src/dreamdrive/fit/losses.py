"""L_render: how far a rendered frame is from its reference (eq. 14), and what keeps geometry sane."""

import math
from typing import Literal

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from dreamdrive.splat import ssim

LossName = Literal["field", "paper"]
# Weights of L1 and of 1 - SSIM. "paper" is eq. 14 as printed, unweighted; "field" is what 3DGS and its
# descendants use.
WEIGHTS: dict[LossName, tuple[float, float]] = {"field": (0.8, 0.2), "paper": (1.0, 1.0)}


def render_loss(
    image: Float[Tensor, "h w 3"],
    reference: Float[Tensor, "h w 3"],
    mask: Bool[Tensor, "h w"] | None,
    name: LossName,
) -> Float[Tensor, ""]:
    """L1 + SSIM between images in [0, 1] (eq. 14).

    Args:
        image: The rendered frame.
        reference: The frame it should equal.
        mask: Pixels that count; elsewhere the reference is taken as met. None means all.
        name: Which weights, see ``WEIGHTS``.
    """
    if mask is not None:
        image = torch.where(mask[..., None], image, reference)
    weight_l1, weight_ssim = WEIGHTS[name]
    l1 = (image - reference).abs().mean()
    return weight_l1 * l1 + weight_ssim * (1 - ssim(image, reference))


def disparity_loss(
    depth_sum: Float[Tensor, "h w"],
    alpha: Float[Tensor, "h w"],
    reference_m: Float[Tensor, "h w"],
    weight: Float[Tensor, "h w"],
) -> Float[Tensor, ""]:
    """Weighted L1 in inverse depth between the expected depth and multi-view stereo, in 1/m.

    Args:
        depth_sum: Depth composited by weight, not divided by alpha.
        alpha: Coverage.
        reference_m: Depth from multi-view stereo; positive where ``weight`` is.
        weight: Trust in it, 0 where there is none.
    """
    inverse = alpha.clamp(min=1e-3) / depth_sum.clamp(min=1e-3)
    target = torch.where(weight > 0, 1 / reference_m.clamp(min=1e-3), inverse.detach())
    return (weight * (inverse - target).abs()).sum() / weight.sum().clamp(min=1.0)


def shape_loss(log_scales: Float[Tensor, "n 3"], ratio: float) -> Float[Tensor, ""]:
    """Mean excess of the logarithm of largest over smallest scale beyond that of ``ratio`` (PhysGaussian)."""
    spread = log_scales.amax(1) - log_scales.amin(1)
    return torch.relu(spread - math.log(ratio)).mean()
