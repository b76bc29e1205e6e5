"""What the benchmark of the GPU computes without one."""

import pytest
import torch

from dreamdrive.splat.ssim import ssim_map_reference
from dreamdrive_bench.splat import gpu, gpu_training as training


def test_without_a_gpu_it_says_so(monkeypatch):
    monkeypatch.setattr("sys.argv", ["gpu.py"])
    monkeypatch.setattr(gpu, "why_unusable", lambda: "torch finds no CUDA device")
    with pytest.raises(SystemExit, match=r"^gpu measures a GPU, .*: torch finds no CUDA device$"):
        gpu.main()


def test_help_needs_no_gpu(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["gpu.py", "--help"])
    with pytest.raises(SystemExit) as done:
        gpu.main()
    assert done.value.code == 0
    assert "--gaussians" in capsys.readouterr().out


def test_the_scene_has_the_size_asked_for_and_is_driven_through():
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


def test_figures_are_medians_and_bests():
    figures = gpu.figures([1.0, 2.0, 4.0], [8.0, 4.0, 2.0])
    assert figures == {
        "ours_per_s": 5,
        "best_ours_per_s": 10,
        "gsplat_per_s": 2.5,
        "best_gsplat_per_s": 5,
        "ratio": 2,
    }


def gpu_row(**other):
    rates = {"ours_per_s": 20.0, "gsplat_per_s": 10.0, "ratio": 2.0}
    case = {"width": 96, "height": 64, "gaussians": 500, "rendering": rates, "training": rates}
    losses = {"ours": [0.2, 0.11], "gsplat": [0.201, 0.1]}
    return {**case, "mean_abs_difference": 1e-6, "loss_first_and_last": losses, **other}


def test_differences_are_printed(capsys):
    assert gpu.disagreements(gpu_row()) == []
    gpu.print_row(gpu_row())
    out = capsys.readouterr().out
    assert "differ by 1.0e-06" in out
    assert "ours 0.2000 to 0.1100, gsplat 0.2010 to 0.1000" in out
    assert "NOT" not in out


@pytest.mark.parametrize(
    ("other", "told"),
    [
        ({"mean_abs_difference": 0.01}, "the images differ by more than 0.001"),
        ({"mean_abs_difference": float("nan")}, "the images differ by more than 0.001"),
        ({"loss_first_and_last": {"ours": [0.21, 0.1], "gsplat": [0.2, 0.1]}}, "the first losses differ by"),
        ({"loss_first_and_last": {"ours": [0.2, 0.2], "gsplat": [0.2, 0.1]}}, "the last losses differ by"),
    ],
)
def test_other_work_is_a_disagreement(capsys, other, told):
    (trouble,) = gpu.disagreements(gpu_row(**other))
    assert trouble.startswith(told)
    gpu.print_row(gpu_row(**other))
    assert f"NOT THE SAME WORK: {told}" in capsys.readouterr().out


@pytest.mark.parametrize(("difference", "code"), [(1e-6, 0), (0.01, 1)])
def test_a_disagreement_fails_and_the_slower_ssim_of_the_peer_is_said(monkeypatch, capsys, difference, code):
    monkeypatch.setattr("sys.argv", ["gpu.py", "--sizes", "96x64", "--gaussians", "500"])
    monkeypatch.setattr(gpu, "why_unusable", lambda: None)
    monkeypatch.setattr(gpu, "load_gsplat", lambda: None)
    monkeypatch.setattr(gpu, "ssim_of_the_peer", lambda: ("plain torch", None))
    monkeypatch.setattr(gpu, "measure", lambda *_: gpu_row(mean_abs_difference=difference))
    monkeypatch.setattr(torch.backends.cudnn, "allow_tf32", torch.backends.cudnn.allow_tf32)
    assert gpu.main() == code
    assert "fused_ssim is not installed: gsplat's steps take SSIM in plain torch" in capsys.readouterr().out


def test_loss_in_closed_form_has_the_value_and_gradient_of_autograd():
    g = torch.Generator().manual_seed(0)
    image, target = torch.rand(2, 23, 31, 3, generator=g, dtype=torch.float64)
    loss, gradient = training.loss_and_gradient(image, target)
    image.requires_grad_()
    expected = 0.8 * (image - target).abs().mean() + 0.2 * (1 - ssim_map_reference(image, target).mean())
    expected.backward()
    assert loss == pytest.approx(expected.item(), rel=1e-12)
    assert torch.allclose(gradient, image.grad, rtol=1e-9, atol=1e-15)
