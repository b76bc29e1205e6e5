"""Likeness of two images pixel by pixel: PSNR, and SSIM in the variants in use."""

from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional

from dreamdrive.splat import C1, C2, SIGMA_PX, WINDOW, ssim_map

SsimBorder = Literal["zero", "reflect", "valid"]
"""What lies outside the image: zeros as in 3DGS, its reflection as in torchmetrics (all pixels count), or
nothing as in pytorch-msssim and scikit-image (only pixels whose whole window is inside count)."""


def psnr(image: Float[Tensor, "h w 3"], target: Float[Tensor, "h w 3"]) -> float:
    """Peak signal to noise ratio in dB of values in [0, 1]; infinite for equal images.

    The squared error is averaged over all pixels and channels in float64.
    """
    error = torch.mean((image.double() - target.double()) ** 2)
    return float(-10 * torch.log10(error))


def ssim(image: Float[Tensor, "h w 3"], target: Float[Tensor, "h w 3"], border: SsimBorder = "zero") -> float:
    """Mean structural similarity of values in [0, 1] (Wang et al. 2004).

    Gaussian window of 11 px with sigma 1.5 px, C1 = 0.01^2, C2 = 0.03^2, each channel by itself. Values of
    different borders are not comparable; ``zero`` is what this project and the 3DGS family report.

    Raises:
        ValueError: The image is too small for the border.
    """
    smallest = {"zero": 1, "reflect": WINDOW // 2 + 1, "valid": WINDOW}[border]
    if min(image.shape[:2]) < smallest:
        raise ValueError(
            f"SSIM with border {border} needs {smallest} px or more, got {tuple(image.shape[:2])}"
        )
    if border == "zero":
        return float(ssim_map(image.float(), target.float()).mean())
    return float(_inner_map(image, target, WINDOW // 2 if border == "reflect" else 0).mean())


def _inner_map(
    image: Float[Tensor, "h w 3"], target: Float[Tensor, "h w 3"], reflected: int
) -> Float[Tensor, "3 h2 w2"]:
    """SSIM where the window is inside the images extended by so many reflected pixels."""
    offsets = torch.arange(WINDOW, dtype=torch.float64) - WINDOW // 2
    weights = torch.exp(-(offsets**2) / (2 * SIGMA_PX**2))
    weights = weights / weights.sum()

    def extended(values: Tensor) -> Tensor:
        planes = values.double().permute(2, 0, 1)[:, None]
        return functional.pad(planes, [reflected] * 4, mode="reflect") if reflected else planes

    def blurred(planes: Tensor) -> Tensor:
        rows = functional.conv2d(planes, weights[None, None, :, None])
        return functional.conv2d(rows, weights[None, None, None, :])

    a, b = extended(image), extended(target)
    mean_a, mean_b = blurred(a), blurred(b)
    # Rounding may leave a tiny negative variance where an image is flat.
    var_a = (blurred(a * a) - mean_a**2).clamp(min=0)
    var_b = (blurred(b * b) - mean_b**2).clamp(min=0)
    covariance = blurred(a * b) - mean_a * mean_b
    numerator = (2 * mean_a * mean_b + C1) * (2 * covariance + C2)
    return (numerator / ((mean_a**2 + mean_b**2 + C1) * (var_a + var_b + C2)))[:, 0]
