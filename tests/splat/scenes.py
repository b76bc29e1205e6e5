"""Small random scenes, and one render with its gradients."""

import math

import torch
from torch import Tensor

from dreamdrive.scene.render import Render
from dreamdrive.splat import rasterize

IMAGES = ("colour", "alpha", "depth_m", "channels")


def random_scene(
    n: int = 200, coefficients: int = 16, channels: int | None = 5, seed: int = 0
) -> dict[str, Tensor]:
    """Gaussians in front of, beside and behind a camera with a rotated pose (float64)."""
    g = torch.Generator().manual_seed(seed)

    def normal(*shape: int) -> Tensor:
        return torch.randn(*shape, generator=g, dtype=torch.float64)

    angle = 0.2 + 0.1 * seed
    pose = torch.eye(4, dtype=torch.float64)
    pose[0, 0] = pose[2, 2] = math.cos(angle)
    pose[0, 2], pose[2, 0] = math.sin(angle), -math.sin(angle)
    pose[:3, 3] = torch.tensor([0.3, -0.2, 0.4])
    scene = {
        "means": normal(n, 3) * torch.tensor([2.0, 1.5, 2.0]) + torch.tensor([0.0, 0.0, 4.0]),
        "quaternions": normal(n, 4),
        "scales": torch.exp(0.6 * normal(n, 3) - 1.6),
        "opacities": torch.sigmoid(2 * normal(n) + 0.5),
        "sh": 0.4 * normal(n, coefficients, 3),
        "camera_from_world": pose,
        "screen_offsets_px": 0.3 * normal(n, 2),
    }
    if channels is not None:
        scene["channels"] = normal(n, channels)
    return scene


def pinhole(width: int = 53, height: int = 37) -> dict[str, float]:
    """A pinhole with its principal point off the middle: the clamp of the Jacobian is not symmetric."""
    return {
        "fx_px": 0.8 * width,
        "fy_px": 0.85 * width,
        "cx_px": 0.47 * width,
        "cy_px": 0.55 * height,
        "width_px": width,
        "height_px": height,
    }


def render_with_gradients(
    scene: dict[str, Tensor],
    backend: str = "native",
    camera: dict[str, float] | None = None,
    sh_degree: int | None = None,
    images: tuple[str, ...] = IMAGES,
    device: str = "cpu",
    **options: bool,
) -> tuple[Render, dict[str, Tensor]]:
    """Render on a device and pull a fixed random gradient back through ``images`` to leaves on the CPU.

    float64 by reference, else float32.
    """
    dtype = torch.float64 if backend == "reference" else torch.float32
    inputs = {name: value.to(dtype).clone().requires_grad_() for name, value in scene.items()}
    there = {name: value.to(device) for name, value in inputs.items()}
    out = rasterize(**there, **(camera or pinhole()), sh_degree=sh_degree, backend=backend, **options)
    g = torch.Generator().manual_seed(7)
    loss = torch.zeros((), dtype=dtype, device=device)
    for name in IMAGES:
        image = getattr(out, name)
        upstream = torch.randn(image.shape, generator=g, dtype=torch.float64).to(device, dtype)
        if name in images:
            loss = loss + (image * upstream).sum()
    loss.backward()
    zero = {name: torch.zeros_like(value) for name, value in inputs.items()}
    return out, {name: zero[name] if value.grad is None else value.grad for name, value in inputs.items()}


def relative(value: Tensor, expected: Tensor) -> float:
    """Norm of the difference over the norm of what is expected."""
    value, expected = value.double().cpu(), expected.double().cpu()
    return (value - expected).norm().item() / max(expected.norm().item(), 1e-12)
