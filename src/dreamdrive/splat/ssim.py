"""Structural similarity of two images (Wang et al. 2004), with the window and padding of 3DGS."""

from collections.abc import Callable
from functools import cache, partial
from importlib import import_module

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn.functional import conv2d

from dreamdrive import _native
from dreamdrive.compute.compiled import Gradients, Wanted, at_once, differentiable

WINDOW = 11
SIGMA_PX = 1.5
C1 = 0.01**2
C2 = 0.03**2


def ssim_map(image: Float[Tensor, "h w 3"], target: Float[Tensor, "h w 3"]) -> Float[Tensor, "h w 3"]:
    """SSIM of every pixel and channel, differentiable in both images.

    Args:
        image: Values in [0, 1], float32, on the CPU.
        target: The same.

    Returns:
        Similarity (H, W, 3) in [-1, 1]: Gaussian window of 11 px with sigma 1.5 px, C1 = 0.01^2, C2 = 0.03^2,
        zero padding.
    """
    for name, value in (("image", image), ("target", target)):
        if (
            value.ndim != 3
            or value.shape[2] != 3
            or value.dtype != torch.float32
            or value.device.type != "cpu"
        ):
            raise ValueError(
                f"{name}: expected float32 (H, W, 3) on the CPU, got {value.dtype} {tuple(value.shape)}"
            )
    if image.shape != target.shape:
        raise ValueError(
            f"target: expected the image's shape {tuple(image.shape)}, got {tuple(target.shape)}"
        )
    return differentiable(_similarity, image, target)


def _gradient(image: Tensor, target: Tensor, partials: Tensor | None, by_map: Tensor) -> Tensor | None:
    if partials is None:
        return None
    out = torch.empty_like(image)
    _native.ssim_backward(image, target, partials, by_map, out)
    return out


def _similarity(image: Tensor, target: Tensor, *, wanted: Wanted) -> tuple[Tensor, Gradients]:
    similarity = torch.empty_like(image)
    by_image, by_target = (torch.empty(3, *image.shape) if needs else None for needs in wanted)
    if by_target is not None:  # symmetric: the target takes the image's place
        _native.ssim_forward(target, image, similarity, by_target)
    _native.ssim_forward(image, target, similarity, by_image)

    def gradients(by_map: Tensor) -> tuple[Tensor | None, Tensor | None]:
        return _gradient(image, target, by_image, by_map), _gradient(target, image, by_target, by_map)

    return similarity, gradients


def ssim(image: Float[Tensor, "h w 3"], target: Float[Tensor, "h w 3"]) -> Float[Tensor, ""]:
    """Mean SSIM of two images with values in [0, 1]; see ``ssim_map``."""
    return ssim_map(image, target).mean()


def ssim_map_reference(
    image: Float[Tensor, "h w 3"], target: Float[Tensor, "h w 3"]
) -> Float[Tensor, "h w 3"]:
    """The same in plain torch, of any floating type and on any device."""
    window = _window(image.dtype, image.device)
    planes = torch.cat([image, target, image * image, target * target, image * target], dim=2)
    planes = planes.permute(2, 0, 1)[:, None]
    down = conv2d(planes, window[None, None, :, None], padding=(WINDOW // 2, 0))
    blurred = conv2d(down, window[None, None, None], padding=(0, WINDOW // 2))
    mean_a, mean_b, square_a, square_b, product = blurred[:, 0].permute(1, 2, 0).split(3, dim=2)
    var_a, var_b = square_a - mean_a**2, square_b - mean_b**2
    covariance = product - mean_a * mean_b
    numerator = (2 * mean_a * mean_b + C1) * (2 * covariance + C2)
    return numerator / ((mean_a**2 + mean_b**2 + C1) * (var_a + var_b + C2))


def mean_ssim(image: Float[Tensor, "h w 3"], target: Float[Tensor, "h w 3"]) -> Float[Tensor, ""]:
    """The mean of ``ssim_map`` on another device than the CPU; differentiable in the first image, once.

    The kernel of the package fused_ssim computes it, where that is installed and tells the same. Plain torch
    takes the gradient in closed form, which blurs 9 planes for it; that of ``ssim_map_reference`` blurs 15,
    and keeps all that it computes.
    """
    fused = None if image.is_cpu else _fused_ssim(image.device)
    if fused is not None:
        return fused(_planes(image)[None], _planes(target)[None])
    return differentiable(_mean_similarity, image, target)


def blurred(planes: Float[Tensor, "c h w"]) -> Float[Tensor, "c h w"]:
    """Planes under the window, zeros beyond the edge.

    Planes are channels, each a group of its own: cuDNN takes 2.5 times as long for them as images.
    """
    weight = _window(planes.dtype, planes.device).repeat(len(planes), 1, 1)
    down = conv2d(planes[None], weight[..., None], padding=(WINDOW // 2, 0), groups=len(planes))
    return conv2d(down, weight[:, :, None], padding=(0, WINDOW // 2), groups=len(planes))[0]


@cache
def _window(dtype: torch.dtype, device: torch.device) -> Float[Tensor, " w"]:
    # A tensor made in inference mode could not be used for training later.
    with torch.inference_mode(False):
        offsets = torch.arange(WINDOW, dtype=dtype, device=device) - WINDOW // 2
        window = torch.exp(-(offsets**2) / (2 * SIGMA_PX**2))
        return window / window.sum()


def _planes(image: Float[Tensor, "h w 3"]) -> Float[Tensor, "3 h w"]:
    return image.permute(2, 0, 1).contiguous()


def _mean_similarity(image: Tensor, target: Tensor, *, wanted: Wanted) -> tuple[Tensor, Gradients]:
    a, b = _planes(image), _planes(target)
    mean_a, mean_b, square_a, square_b, product = blurred(torch.cat([a, b, a * a, b * b, a * b])).chunk(5)
    ab, means = mean_a * mean_b, mean_a * mean_a + mean_b * mean_b
    a1, a2 = 2 * ab + C1, 2 * (product - ab) + C2
    b1, b2 = means + C1, square_a + square_b - means + C2
    over = 1 / (b1 * b2)
    similarity = a1 * a2 * over
    if not wanted[0]:
        return similarity.mean(), at_once(None, None)
    by_mean = 2 * over * (mean_b * (a2 - a1) - mean_a * similarity * (b2 - b1))
    partials = torch.cat([by_mean, -similarity / b2, 2 * a1 * over])

    def gradients(upstream: Tensor) -> tuple[Tensor | None, None]:
        by_mean, by_square, by_product = blurred(partials).chunk(3)
        by_image = (by_mean + 2 * a * by_square + b * by_product) * (upstream / a.numel())
        return by_image.permute(1, 2, 0), None

    return similarity.mean(), gradients


@cache
def _fused_ssim(device: torch.device) -> Callable[[Tensor, Tensor], Tensor] | None:
    """What the package of this name computes for planes (1, 3, H, W), if that is our mean and gradient.

    Other packages bear the name, too; they differ at the edge, which a small image has most of.
    """
    try:
        fused = partial(import_module("fused_ssim").fused_ssim, padding="same")
    except ImportError:
        return None

    with torch.enable_grad():
        image = torch.linspace(0, 1, 3 * 16 * 20, device=device).view(16, 20, 3).requires_grad_()
        target = image.detach().flip(0).square()
        theirs = fused(*(_planes(each)[None] for each in (image, target)))
        ours = differentiable(_mean_similarity, image, target)
        gradients = [torch.autograd.grad(each, image)[0] for each in (theirs, ours)]
    same = torch.allclose(theirs, ours, rtol=1e-4) and torch.allclose(*gradients, rtol=1e-2, atol=1e-5)
    return fused if same else None
