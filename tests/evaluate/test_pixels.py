"""PSNR and the variants of SSIM against the programs they are named after."""

from pathlib import Path

import pytest
import torch
from tests.evaluate.golden import Golden

from dreamdrive.evaluate.pixels import psnr, ssim

VARIANTS = {
    "zero": "ssim_3dgs_zero_pad",
    "reflect": "ssim_torchmetrics_reflect_pad",
    "valid": "ssim_pytorch_msssim_valid",
}


@pytest.mark.parametrize("index", range(5))
def test_golden_likeness(golden_dir: Path, index: int) -> None:
    golden = Golden(golden_dir, "perceptual")
    expected = golden.values[f"image_{index}"]
    a, b = (golden.tensor(f"{index}/{name}").permute(1, 2, 0).contiguous() for name in "ab")
    assert psnr(a, b) == pytest.approx(float(expected["psnr"]), rel=1e-6, abs=1e-6)
    rounded = torch.round(b * 255) / 255
    assert psnr(a, rounded) == pytest.approx(expected["psnr_after_8bit_rounding_of_second"], rel=1e-5)
    for border, name in VARIANTS.items():
        assert ssim(a, b, border) == pytest.approx(expected[name], rel=1e-4), border  # type: ignore[arg-type]


@pytest.mark.parametrize(("border", "size"), [("reflect", 5), ("valid", 10)])
def test_an_image_too_small_for_its_border(border, size: int) -> None:
    image = torch.zeros(size, 40, 3)
    with pytest.raises(ValueError, match=f"{size + 1} px or more"):
        ssim(image, image, border)
