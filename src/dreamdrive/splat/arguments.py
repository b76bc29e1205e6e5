"""What a splatting backend is given, and the checks every backend shares."""

import math
from dataclasses import dataclass
from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor

COEFFICIENTS = {1: 0, 4: 1, 9: 2, 16: 3}
MAX_SIDE_PX = 32768


@dataclass(frozen=True)
class SplatArguments:
    """Gaussians with activated parameters and the pinhole that looks at them.

    Attributes:
        means: Centres (N, 3) in metres, world frame.
        quaternions: Rotations (N, 4), wxyz; normalised inside.
        scales: Standard deviations (N, 3) in metres.
        opacities: In [0, 1] (N,).
        sh: Spherical-harmonic colour (N, K, 3), K = 1, 4, 9 or 16.
        camera_from_world: Rigid transform (4, 4) to the camera frame (x right, y down, z forward).
        focal_px: Focal lengths (fx, fy).
        centre_px: Principal point (cx, cy); the centre of the top-left pixel is at (0.5, 0.5).
        size_px: Image width and height.
        sh_degree: Degree evaluated, at most the stored one.
        channels: Further values per Gaussian (N, C), composited like colour, or None.
        screen_offsets_px: Added to the projected centres (N, 2), or None.
        screen_absolute_px: Changes nothing (N, 2); its gradient is the sum over the pixels of the absolute
            gradients by the projected centres. Or None.
        antialiased: Whether opacities shrink by what the blur adds to the footprints.
        inspect: Whether median depth and the weights of the Gaussians are wanted.
    """

    means: Float[Tensor, "n 3"]
    quaternions: Float[Tensor, "n 4"]
    scales: Float[Tensor, "n 3"]
    opacities: Float[Tensor, " n"]
    sh: Float[Tensor, "n k 3"]
    camera_from_world: Float[Tensor, "4 4"]
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    size_px: tuple[int, int]
    sh_degree: int
    channels: Float[Tensor, "n c"] | None = None
    screen_offsets_px: Float[Tensor, "n 2"] | None = None
    screen_absolute_px: Float[Tensor, "n 2"] | None = None
    antialiased: bool = False
    inspect: bool = False

    def tensors(self) -> dict[str, Tensor]:
        """The present tensors by the name of their argument."""
        names = (
            "means",
            "quaternions",
            "scales",
            "opacities",
            "sh",
            "camera_from_world",
            "channels",
            "screen_offsets_px",
            "screen_absolute_px",
        )
        named = ((name, getattr(self, name)) for name in names)
        return {name: value for name, value in named if value is not None}


def check_shapes(tensors: dict[str, Tensor | None]) -> None:
    """Raise ``ValueError`` naming the first argument whose shape is not what splatting expects."""
    means = tensors["means"]
    count = means.shape[0] if isinstance(means, Tensor) and means.ndim == 2 else "N"
    shapes: dict[str, tuple[int | str, ...]] = {
        "means": (count, 3),
        "quaternions": (count, 4),
        "scales": (count, 3),
        "opacities": (count,),
        "sh": (count, "K", 3),
        "camera_from_world": (4, 4),
        "channels": (count, "C"),
        "screen_offsets_px": (count, 2),
        "screen_absolute_px": (count, 2),
    }
    for name, value in tensors.items():
        if value is None:
            continue
        if not isinstance(value, Tensor):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ValueError(f"{name}: expected a torch tensor, got {type(value).__name__}")
        shape = shapes[name]
        if name == "camera_from_world" and value.ndim == 3 and len(value):
            shape = (len(value), *shape)
        fits = value.ndim == len(shape) and all(
            isinstance(e, str) or e == s for e, s in zip(shape, value.shape, strict=True)
        )
        if not fits:
            expected = str(shape).replace("'", "")
            raise ValueError(f"{name}: expected shape {expected}, got {tuple(value.shape)}")
    sh = tensors["sh"]
    if sh is not None and sh.shape[1] not in COEFFICIENTS:
        raise ValueError(f"sh: expected 1, 4, 9 or 16 coefficients a channel, got {sh.shape[1]}")


def check_pinhole(
    focal_px: tuple[float, float], centre_px: tuple[float, float], size_px: tuple[int, int]
) -> None:
    """Raise ``ValueError`` unless focal lengths are positive, the centre finite and the size sensible."""
    for name, value in zip(("fx_px", "fy_px"), focal_px, strict=True):
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name}: expected a positive number of pixels, got {value}")
    for name, value in zip(("cx_px", "cy_px"), centre_px, strict=True):
        if not math.isfinite(value):
            raise ValueError(f"{name}: expected a finite number of pixels, got {value}")
    for name, value in zip(("width_px", "height_px"), size_px, strict=True):
        if not 1 <= value <= MAX_SIDE_PX:
            raise ValueError(f"{name}: expected 1 to {MAX_SIDE_PX}, got {value}")


def active_degree(wanted: int | None, stored: int) -> int:
    """The SH degree to evaluate when ``stored`` coefficients a channel are there; None means all."""
    degree = COEFFICIENTS[stored]
    if wanted is None:
        return degree
    if not 0 <= wanted <= degree:
        raise ValueError(
            f"sh_degree: expected 0 to {degree} ({stored} coefficients are stored), got {wanted}"
        )
    return wanted


def check_device(tensors: dict[str, Tensor], kind: Literal["cpu", "cuda"]) -> None:
    """Raise ``ValueError`` naming the first tensor that is not on a device of ``kind``, the same for all."""
    first = tensors["means"].device
    for name, value in tensors.items():
        if value.device.type != kind:
            where = "the CPU" if kind == "cpu" else "a CUDA device"
            raise ValueError(f"{name}: expected a tensor on {where}, got one on {value.device}")
        if value.device != first:
            raise ValueError(
                f"{name}: expected a tensor on {first} like the means, got one on {value.device}"
            )


def check_dtype(tensors: dict[str, Tensor], dtypes: tuple[torch.dtype, ...]) -> None:
    """Raise ``ValueError`` naming the first tensor whose type is not among ``dtypes``."""
    for name, value in tensors.items():
        if value.dtype not in dtypes:
            expected = " or ".join(str(d).removeprefix("torch.") for d in dtypes)
            raise ValueError(f"{name}: expected {expected}, got {str(value.dtype).removeprefix('torch.')}")
