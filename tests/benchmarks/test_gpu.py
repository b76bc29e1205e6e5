"""What the benchmark of the GPU computes without one."""

from types import ModuleType

import pytest
import torch
from tests.conftest import ROOT

from dreamdrive.splat.ssim import ssim_map_reference


@pytest.fixture
def gpu(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    import gpu

    return gpu


@pytest.fixture
def training(gpu: ModuleType) -> ModuleType:
    import _gpu_training

    return _gpu_training


def test_without_a_gpu_it_says_so(gpu, monkeypatch):
    monkeypatch.setattr("sys.argv", ["gpu.py"])
    monkeypatch.setattr(gpu, "why_unusable", lambda: "torch finds no CUDA device")
    with pytest.raises(SystemExit, match=r"^gpu\.py measures a GPU, .*: torch finds no CUDA device$"):
        gpu.main()


def test_help_needs_no_gpu(gpu, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["gpu.py", "--help"])
    with pytest.raises(SystemExit) as done:
        gpu.main()
    assert done.value.code == 0
    assert "--gaussians" in capsys.readouterr().out


def test_the_scene_has_the_size_asked_for_and_is_driven_through(gpu):
    gaussians, camera, poses = gpu.scene(96, 64, 500, "cpu")
    assert {name: tuple(value.shape) for name, value in gaussians.items()} == {
        "means": (500, 3),
        "quaternions": (500, 4),
        "scales": (500, 3),
        "opacities": (500,),
        "sh": (500, 16, 3),
    }
    assert (camera["width_px"], camera["height_px"]) == (96, 64)
    assert torch.allclose(poses[:-1, 2, 3] - poses[1:, 2, 3], torch.tensor(gpu.STRIDE_M))


def test_figures_are_medians_and_bests(gpu):
    figures = gpu.figures([1.0, 2.0, 4.0], [8.0, 4.0, 2.0])
    assert figures == {
        "ours_per_s": 5,
        "best_ours_per_s": 10,
        "gsplat_per_s": 2.5,
        "best_gsplat_per_s": 5,
        "ratio": 2,
    }


def test_loss_in_closed_form_has_the_value_and_gradient_of_autograd(training):
    g = torch.Generator().manual_seed(0)
    image, target = torch.rand(2, 23, 31, 3, generator=g, dtype=torch.float64)
    loss, gradient = training.loss_and_gradient(image, target)
    image.requires_grad_()
    expected = 0.8 * (image - target).abs().mean() + 0.2 * (1 - ssim_map_reference(image, target).mean())
    expected.backward()
    assert loss == pytest.approx(expected.item(), rel=1e-12)
    assert torch.allclose(gradient, image.grad, rtol=1e-9, atol=1e-15)
