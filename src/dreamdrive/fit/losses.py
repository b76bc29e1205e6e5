"""L_render: how far a rendered frame is from its reference (eq. 14), and what keeps geometry sane."""

from functools import partial
from typing import Literal

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from dreamdrive import _native
from dreamdrive.compute.compiled import Gradients, Wanted, at_once, differentiable
from dreamdrive.compute.device import in_core
from dreamdrive.splat import check_dtype, mean_ssim

LossName = Literal["field", "paper"]
# Weights of L1 and of 1 - SSIM. "paper" is eq. 14 as printed, unweighted; "field" is what 3DGS and its
# descendants use.
WEIGHTS: dict[LossName, tuple[float, float]] = {"field": (0.8, 0.2), "paper": (1.0, 1.0)}
LEAST = 1e-3
"""What alpha and depths count as at least."""


def render_loss(
    image: Float[Tensor, "h w 3"],
    reference: Float[Tensor, "h w 3"],
    mask: Bool[Tensor, "h w"] | None,
    name: LossName,
) -> Float[Tensor, ""]:
    """L1 + SSIM between images in [0, 1] (eq. 14); differentiable in the first.

    Args:
        image: The rendered frame, float32.
        reference: The frame it should equal.
        mask: Pixels that count; elsewhere the reference is taken as met. None means all.
        name: Which weights, see ``WEIGHTS``.

    Raises:
        ValueError: An image is not float32, or the reference requires a gradient.
    """
    check_dtype({"image": image, "reference": reference}, (torch.float32,))
    if reference.requires_grad:
        raise ValueError("reference: the render loss has no gradient for it; detach it")
    if mask is None:
        mask = torch.ones(image.shape[:2], dtype=torch.bool, device=image.device)
    if not in_core(image):
        image = torch.where(mask[..., None], image, reference)
        of_l1, of_ssim = WEIGHTS[name]
        return of_l1 * (image - reference).abs().mean() + of_ssim * (1 - mean_ssim(image, reference))
    return differentiable(partial(_l1_and_ssim, *WEIGHTS[name]), image, reference, mask)


def _l1_and_ssim(
    by_l1: float, by_ssim: float, image: Tensor, reference: Tensor, mask: Tensor, *, wanted: Wanted
) -> tuple[Tensor, Gradients]:
    partials = torch.empty(3, *image.shape) if wanted[0] else None
    l1, similarity = _native.l1_ssim(image, reference, mask, partials)

    def gradients(upstream: Tensor) -> tuple[Tensor | None, ...]:
        assert partials is not None
        scale, d_image = upstream.item(), torch.empty_like(image)
        _native.l1_ssim_backward(image, reference, mask, partials, scale * by_l1, -scale * by_ssim, d_image)
        return d_image, None, None

    return torch.tensor(by_l1 * l1 + by_ssim * (1 - similarity), dtype=torch.float32), gradients


def geometry_loss(
    depth_sum: Float[Tensor, "h w"],
    alpha: Float[Tensor, "h w"],
    reference_m: Float[Tensor, "h w"],
    weight: Float[Tensor, "h w"],
    sky: Bool[Tensor, "h w"],
    disparity_weight: float,
    sky_weight: float,
) -> Float[Tensor, ""]:
    """Disparity where stereo knows it, coverage where there is sky; differentiable in the first two.

    ``disparity_weight`` times the mean of |alpha / depth_sum - 1 / reference_m| in 1/m, weighted by
    ``weight`` (whose sum counts as 1 at least), plus ``sky_weight`` times the mean over all pixels of alpha
    in the sky. Alpha and depths count as ``LEAST`` at least.

    Args:
        depth_sum: Depth composited by weight, not divided by alpha.
        alpha: Coverage.
        reference_m: Depth from multi-view stereo; positive where ``weight`` is.
        weight: Trust in it, 0 where there is none.
        sky: Pixels that nothing should cover.
        disparity_weight: Weight of the first term.
        sky_weight: Weight of the second.
    """
    if not in_core(alpha):
        inverse = alpha.clamp(min=LEAST) / depth_sum.clamp(min=LEAST)
        off = torch.where(weight > 0, inverse - 1 / reference_m.clamp(min=LEAST), 0.0).abs()
        disparity = (weight * off).sum() / weight.sum().clamp(min=1.0)
        return disparity_weight * disparity + sky_weight * (alpha * sky).mean()
    compute = partial(_disparity_and_cover, disparity_weight, sky_weight)
    return differentiable(compute, depth_sum, alpha, reference_m, weight, sky)


def _disparity_and_cover(
    by_disparity: float,
    by_cover: float,
    depth_sum: Tensor,
    alpha: Tensor,
    reference_m: Tensor,
    weight: Tensor,
    sky: Tensor,
    *,
    wanted: Wanted,
) -> tuple[Tensor, Gradients]:
    d_depth_sum, d_alpha = (torch.empty_like(alpha) if any(wanted) else None for _ in range(2))
    whole = max(1.0, weight.sum().item())
    loss = _native.geometry_loss(
        depth_sum, alpha, reference_m, weight, sky, by_disparity, by_cover, whole, d_depth_sum, d_alpha
    )
    return torch.tensor(loss, dtype=torch.float32), at_once(d_depth_sum, d_alpha, None, None, None)
