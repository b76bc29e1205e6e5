"""PSNR and the variants of SSIM against the programs they are named after."""

import pytest
import torch

from dreamdrive.vision.pixels import psnr, ssim
from tests.golden.reading import cases, tensors, values

VARIANTS = {
    "zero": "ssim_3dgs_zero_pad",
    "reflect": "ssim_torchmetrics_reflect_pad",
    "valid": "ssim_pytorch_msssim_valid",
}


@pytest.mark.parametrize("index", cases("eval/perceptual.json", r"image_(\d+)"))
def test_golden_likeness(index: str) -> None:
    expected, images = values("eval/perceptual.json")[f"image_{index}"], tensors("eval/perceptual.npz")
    a, b = (images[f"{index}/{name}"].permute(1, 2, 0).contiguous() for name in "ab")
    # In dB, of which float32 images have some hundred.
    assert psnr(a, b) == pytest.approx(float(expected["psnr"]), abs=1e-4)
    rounded = torch.round(b * 255) / 255
    wanted = float(expected["psnr_after_8bit_rounding_of_second"])
    assert psnr(a, rounded) == pytest.approx(wanted, abs=1e-3)
    for border, name in VARIANTS.items():
        # At most 1; variances are differences of squares, which float32 rounds to 1e-4 of the constants.
        assert ssim(a, b, border) == pytest.approx(expected[name], abs=1e-4), border  # type: ignore[arg-type]


@pytest.mark.parametrize(("border", "size"), [("reflect", 5), ("valid", 10)])
def test_an_image_too_small_for_its_border(border, size: int) -> None:
    image = torch.zeros(size, 40, 3)
    with pytest.raises(ValueError, match=f"{size + 1} px or more"):
        ssim(image, image, border)
