"""Structural similarity of two images (Wang et al. 2004), with the window and padding of 3DGS."""

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive import _native
from dreamdrive.compute.compiled import Gradients, Wanted, differentiable

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
    offsets = torch.arange(WINDOW, dtype=image.dtype, device=image.device) - WINDOW // 2
    window = torch.exp(-(offsets**2) / (2 * SIGMA_PX**2))
    window = window / window.sum()
    planes = torch.cat([image, target, image * image, target * target, image * target], dim=2)
    planes = planes.permute(2, 0, 1)[:, None]
    down = torch.nn.functional.conv2d(planes, window[None, None, :, None], padding=(WINDOW // 2, 0))
    blurred = torch.nn.functional.conv2d(down, window[None, None, None], padding=(0, WINDOW // 2))
    mean_a, mean_b, square_a, square_b, product = blurred[:, 0].permute(1, 2, 0).split(3, dim=2)
    var_a, var_b = square_a - mean_a**2, square_b - mean_b**2
    covariance = product - mean_a * mean_b
    numerator = (2 * mean_a * mean_b + C1) * (2 * covariance + C2)
    return numerator / ((mean_a**2 + mean_b**2 + C1) * (var_a + var_b + C2))
