"""L_render: how far a rendered frame is from its reference (eq. 14), and what keeps geometry sane."""

from typing import Any, Literal

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.autograd.function import once_differentiable

from dreamdrive import _native
from dreamdrive.device import in_core
from dreamdrive.splat import check_dtype, ssim_map_reference

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
        similarity = ssim_map_reference(image, reference).mean()
        return of_l1 * (image - reference).abs().mean() + of_ssim * (1 - similarity)
    return _RenderLoss.apply(image, reference, mask, *WEIGHTS[name])  # pyright: ignore[reportReturnType]


class _RenderLoss(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, image: Tensor, reference: Tensor, mask: Tensor, weight_l1: float, weight_ssim: float
    ) -> Tensor:
        a, b, mask = (t.detach().contiguous() for t in (image, reference, mask))
        partials = torch.empty(3, *a.shape) if ctx.needs_input_grad[0] else None
        l1, similarity = _native.l1_ssim(a, b, mask, partials)
        ctx.save_for_backward(a, b, mask, partials)
        ctx.weights = weight_l1, weight_ssim
        return torch.tensor(weight_l1 * l1 + weight_ssim * (1 - similarity), dtype=torch.float32)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *upstream: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        image, reference, mask, partials = ctx.saved_tensors
        scale, (weight_l1, weight_ssim) = upstream[0].item(), ctx.weights
        d_image = torch.empty_like(image)
        _native.l1_ssim_backward(
            image, reference, mask, partials, scale * weight_l1, -scale * weight_ssim, d_image
        )
        return d_image, None, None, None, None


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
    return _GeometryLoss.apply(depth_sum, alpha, reference_m, weight, sky, disparity_weight, sky_weight)  # pyright: ignore[reportReturnType]


class _GeometryLoss(torch.autograd.Function):
    """Each pixel stands for itself: the gradient costs no more than the value and is kept in its place."""

    @staticmethod
    def forward(ctx: Any, *inputs: Any) -> Tensor:
        depth_sum, alpha, reference_m, weight, sky = (t.detach().contiguous() for t in inputs[:5])
        wanted = any(ctx.needs_input_grad)
        d_depth_sum, d_alpha = (torch.empty_like(alpha) if wanted else None for _ in range(2))
        whole = max(1.0, weight.sum().item())
        loss = _native.geometry_loss(
            depth_sum, alpha, reference_m, weight, sky, inputs[5], inputs[6], whole, d_depth_sum, d_alpha
        )
        ctx.save_for_backward(d_depth_sum, d_alpha)
        return torch.tensor(loss, dtype=torch.float32)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *upstream: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        d_depth_sum, d_alpha = ctx.saved_tensors
        return upstream[0] * d_depth_sum, upstream[0] * d_alpha, None, None, None, None, None
