"""Arguments of a splatting backend, and the checks every backend shares."""

from dataclasses import dataclass, fields
from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.scene.camera import check_rigid

COEFFICIENTS = {1: 0, 4: 1, 9: 2, 16: 3}
MAX_SIDE_PX = 32768
MAX_PINHOLE_PX = 1e9
LARGEST = 1e30  # products of it with a weight or an upstream gradient stay finite in float32
SHORTEST, LONGEST = 1e-12, 1e18  # quaternions that float32 can normalise
POSE_TOLERANCE = 1e-3
_FINITE = (-LARGEST, LARGEST, f"finite numbers (at most {LARGEST:g} in magnitude)")
_RANGES = {
    "means": _FINITE,
    "quaternions": (SHORTEST, LONGEST, f"lengths from {SHORTEST:g} to {LONGEST:g}"),
    "scales": (0.0, LARGEST, "finite numbers of at least 0"),
    "opacities": (0.0, 1.0, "numbers from 0 to 1"),
    "sh": _FINITE,
    "channels": _FINITE,
    "screen_offsets_px": _FINITE,
}


@dataclass(frozen=True)
class SplatArguments:
    """Gaussians with activated parameters and the pinhole that looks at them; see ``rasterize``.

    Attributes:
        focal_px: Focal lengths (fx, fy).
        centre_px: Principal point (cx, cy); the centre of the top-left pixel is at (0.5, 0.5).
        size_px: Image width and height.
        sh_degree: Degree evaluated, at most the stored one.
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
        named = ((field.name, getattr(self, field.name)) for field in fields(self))
        return {name: value for name, value in named if isinstance(value, Tensor)}


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
        if not value.is_floating_point():
            raise ValueError(
                f"{name}: expected a floating type, got {str(value.dtype).removeprefix('torch.')}"
            )
    sh = tensors["sh"]
    if sh is not None and sh.shape[1] not in COEFFICIENTS:
        raise ValueError(f"sh: expected 1, 4, 9 or 16 coefficients a channel, got {sh.shape[1]}")


def check_pinhole(
    focal_px: tuple[float, float], centre_px: tuple[float, float], size_px: tuple[int, int]
) -> None:
    """Raise ``ValueError`` unless focal lengths are positive, the centre finite and the size sensible."""
    for name, value in zip(("fx_px", "fy_px"), focal_px, strict=True):
        if not 0 < value <= MAX_PINHOLE_PX:
            raise ValueError(
                f"{name}: expected a positive number of pixels up to {MAX_PINHOLE_PX:g}, got {value}"
            )
    for name, value in zip(("cx_px", "cy_px"), centre_px, strict=True):
        if not abs(value) <= MAX_PINHOLE_PX:
            raise ValueError(f"{name}: expected a number of pixels up to {MAX_PINHOLE_PX:g}, got {value}")
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


def check_pose(camera_from_world: Float[Tensor, "4 4"]) -> None:
    """Raise ``ValueError`` unless the pose is a rigid transform: a rotation, a translation, last row 0 0 0 1.

    An optimiser that moves all 12 entries may leave the rotations by ``POSE_TOLERANCE``.
    """
    check_rigid(camera_from_world.detach().numpy(), "camera_from_world", POSE_TOLERANCE)


def check_values(arguments: SplatArguments) -> None:
    """Raise ``ValueError`` naming the first argument with a number that splatting cannot use, and its row.

    The native core's ``all_usable`` tells in one quick pass whether there is any.
    """
    for name, (low, high, expected) in _RANGES.items():
        value = getattr(arguments, name)
        if value is None:
            continue
        numbers = value.detach()
        if name == "quaternions":
            numbers = numbers.norm(dim=1)
        bad = ~((numbers >= low) & (numbers <= high))  # true for NaN
        if bad.any():
            row = int(torch.nonzero(bad)[0, 0])
            raise ValueError(f"{name}: expected {expected}, got {numbers[bad][0]:g} in row {row}")
