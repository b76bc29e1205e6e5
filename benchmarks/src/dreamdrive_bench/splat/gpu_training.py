"""One training step on a GPU, ours and gsplat's default: the same parameters, images and learning rates.

gsplat's is that of its example trainer (examples/simple_trainer.py) with its defaults, but no densification:
``gsplat.rasterization`` unpacked, L1 and SSIM mixed 0.8 to 0.2, a fused Adam for each kind of parameter, the
loss read back for the progress bar. Its SSIM comes from the package fused_ssim where that is installed.

Ours renders through ``rasterize``, takes the loss and its gradient in closed form as one CUDA graph, has one
fused Adam for all parameters and never reads the loss.
"""

import importlib.util
from collections.abc import Callable
from types import ModuleType

import torch
from torch import Tensor
from torch.nn.functional import l1_loss

from dreamdrive.splat import C1, C2, NEAR_M, blurred, rasterize

Step = Callable[[int], Tensor]

RATES = {"means": 1.6e-4, "scales": 5e-3, "quats": 1e-3, "opacities": 5e-2, "sh0": 2.5e-3, "shN": 2.5e-3 / 20}
"""gsplat's defaults for a scene of extent 1."""
DECAY = 0.01 ** (1 / 30_000)
"""Of the rate of the means, each step."""
WEIGHT_SSIM = 0.2


def leaves(gaussians: dict[str, Tensor]) -> dict[str, Tensor]:
    """What is learned of ``rasterize``'s arguments, by gsplat's names, with the base colour disturbed."""
    generator = torch.Generator(gaussians["means"].device).manual_seed(0)
    base = gaussians["sh"][:, :1]
    noise = torch.randn(base.shape, generator=generator, device=base.device)
    values = {
        "means": gaussians["means"],
        "scales": gaussians["scales"].log(),
        "quats": gaussians["quaternions"],
        "opacities": torch.logit(gaussians["opacities"]),
        "sh0": base + 0.3 * noise,
        "shN": gaussians["sh"][:, 1:],
    }
    return {name: value.detach().clone().requires_grad_() for name, value in values.items()}


def loss_and_gradient(image: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
    """0.8 L1 + 0.2 (1 - SSIM) of images (H, W, 3) and its gradient with respect to the first."""
    a, b = image.permute(2, 0, 1), target.permute(2, 0, 1)
    mean_a, mean_b, square_a, square_b, product = blurred(torch.cat([a, b, a * a, b * b, a * b])).chunk(5)
    a1, a2 = 2 * mean_a * mean_b + C1, 2 * (product - mean_a * mean_b) + C2
    b1, b2 = mean_a**2 + mean_b**2 + C1, square_a - mean_a**2 + square_b - mean_b**2 + C2
    similarity = a1 * a2 / (b1 * b2)
    by_mean = 2 * mean_b * (a2 - a1) / (b1 * b2) - 2 * mean_a * similarity * (1 / b1 - 1 / b2)
    by_moments = blurred(torch.cat([by_mean, -similarity / b2, 2 * a1 / (b1 * b2)])).chunk(3)
    by_similarity = by_moments[0] + 2 * a * by_moments[1] + b * by_moments[2]
    loss = (1 - WEIGHT_SSIM) * (a - b).abs().mean() + WEIGHT_SSIM * (1 - similarity.mean())
    gradient = ((1 - WEIGHT_SSIM) * torch.sign(a - b) - WEIGHT_SSIM * by_similarity) / a.numel()
    return loss, gradient.permute(1, 2, 0)


class GraphedLoss:
    """``loss_and_gradient`` for images of one size, launched as one; the next call overwrites the result."""

    def __init__(self, example: Tensor) -> None:
        self._image, self._target = torch.zeros_like(example), torch.zeros_like(example)
        aside = torch.cuda.Stream()
        aside.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(aside):  # a capture must not meet anything for the first time
            for _ in range(3):
                loss_and_gradient(self._image, self._target)
        torch.cuda.current_stream().wait_stream(aside)
        self._graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(self._graph):
            self._result = loss_and_gradient(self._image, self._target)

    def __call__(self, image: Tensor, target: Tensor) -> tuple[Tensor, Tensor]:
        """Loss and gradient."""
        self._image.copy_(image)
        self._target.copy_(target)
        self._graph.replay()
        return self._result


def our_step(gaussians: dict[str, Tensor], camera: dict[str, float], poses: Tensor, targets: Tensor) -> Step:
    """A step on view i (modulo their number) that waits for the GPU only where gsplat's tile lists do."""
    learned = leaves(gaussians)
    groups = [{"params": [leaf], "lr": RATES[name]} for name, leaf in learned.items()]
    optimiser = torch.optim.Adam(groups, eps=1e-15, fused=True)
    loss_of = GraphedLoss(targets[0])

    def step(i: int) -> Tensor:
        view = i % len(poses)
        colour = rasterize(
            learned["means"],
            learned["quats"],
            torch.exp(learned["scales"]),
            torch.sigmoid(learned["opacities"]),
            torch.cat([learned["sh0"], learned["shN"]], dim=1),
            poses[view],
            **camera,
            backend="gsplat",
        ).colour
        loss, gradient = loss_of(colour.detach(), targets[view])
        colour.backward(gradient)
        optimiser.step()
        optimiser.zero_grad(set_to_none=True)
        optimiser.param_groups[0]["lr"] *= DECAY
        return loss

    return step


def intrinsics(camera: dict[str, float], device: torch.device) -> Tensor:
    """The pinhole as a matrix (3, 3)."""
    fx, fy, cx, cy = (camera[k] for k in ("fx_px", "fy_px", "cx_px", "cy_px"))
    return torch.tensor([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], device=device)


def ssim_of_the_peer() -> tuple[str, Callable[[Tensor, Tensor], Tensor]]:
    """SSIM of images (1, 3, H, W) as gsplat's trainer takes it, and where it comes from."""
    if importlib.util.find_spec("fused_ssim") is not None:
        from fused_ssim import fused_ssim

        return "fused_ssim", lambda a, b: fused_ssim(a, b, padding="valid")

    def ssim(a: Tensor, b: Tensor) -> Tensor:
        a, b = a[0], b[0]
        mean_a, mean_b, square_a, square_b, product = blurred(torch.cat([a, b, a * a, b * b, a * b])).chunk(5)
        covariance = product - mean_a * mean_b
        spread = square_a - mean_a**2 + square_b - mean_b**2
        numerator = (2 * mean_a * mean_b + C1) * (2 * covariance + C2)
        return (numerator / ((mean_a**2 + mean_b**2 + C1) * (spread + C2))).mean()

    return "plain torch", ssim


def gsplat_step(
    gsplat: ModuleType, gaussians: dict[str, Tensor], camera: dict[str, float], poses: Tensor, targets: Tensor
) -> Step:
    """The peer's step on view i (modulo their number)."""
    learned = leaves(gaussians)
    optimisers = {
        name: torch.optim.Adam([{"params": [leaf], "lr": RATES[name]}], eps=1e-15, fused=True)
        for name, leaf in learned.items()
    }
    schedule = torch.optim.lr_scheduler.ExponentialLR(optimisers["means"], gamma=DECAY)
    matrix = intrinsics(camera, poses.device)[None]
    _, ssim = ssim_of_the_peer()

    def step(i: int) -> Tensor:
        view = i % len(poses)
        image, _, _ = gsplat.rasterization(
            learned["means"],
            learned["quats"],
            torch.exp(learned["scales"]),
            torch.sigmoid(learned["opacities"]),
            torch.cat([learned["sh0"], learned["shN"]], dim=1),
            poses[view][None],
            matrix,
            camera["width_px"],
            camera["height_px"],
            near_plane=NEAR_M,
            sh_degree=3,
            packed=False,
        )
        target = targets[view][None]
        similarity = ssim(image.permute(0, 3, 1, 2), target.permute(0, 3, 1, 2))
        loss = torch.lerp(l1_loss(image, target), 1 - similarity, WEIGHT_SSIM)
        loss.backward()
        loss.item()
        for optimiser in optimisers.values():
            optimiser.step()
            optimiser.zero_grad(set_to_none=True)
        schedule.step()
        return loss.detach()

    return step
