"""The ways in which programs bring images to the size of a network; each gives another FID. And padding."""

import torch
from jaxtyping import Float, UInt8
from torch import Tensor
from torch.nn import functional

from dreamdrive.names import Resize


def resize(
    images: UInt8[Tensor, "n h w 3"], height: int, width: int, method: Resize
) -> Float[Tensor, "n 3 {height} {width}"]:
    """Images of another size with values in [0, 255], not rounded; the aspect ratio is not kept."""
    planes = images.permute(0, 3, 1, 2).float()
    size = (height, width)
    if method == "tf1":
        return _from_corner(_from_corner(planes, height, 2), width, 3)
    if method in ("torch", "antialias"):
        smooth = method == "antialias"
        return functional.interpolate(planes, size, mode="bilinear", align_corners=False, antialias=smooth)
    if method == "clean":
        wide = functional.interpolate(planes, size, mode="bicubic", align_corners=False, antialias=True)
        return wide.clamp(0, 255)
    raise ValueError(f"resize method {method!r}: expected tf1, torch, antialias or clean")


def _from_corner(planes: Float[Tensor, "n 3 _ _"], size: int, axis: int) -> Float[Tensor, "n 3 _ _"]:
    """Linear interpolation along an axis at index * old / new, the last pixel repeated."""
    old = planes.shape[axis]
    position = torch.arange(size, dtype=torch.float32) * (old / size)
    below = position.floor().long().clamp(max=old - 1)
    above = (below + 1).clamp(max=old - 1)
    share = (position - below).reshape([-1 if i == axis else 1 for i in range(4)])
    first = planes.index_select(axis, below)
    return first + (planes.index_select(axis, above) - first) * share


def pad_same(
    x: Float[Tensor, "n c *size"], kernel: tuple[int, ...], stride: tuple[int, ...]
) -> Float[Tensor, "n c *padded"]:
    """TensorFlow's ``SAME``: zeros so that windows in steps of ``stride`` give ceil(size / stride) values.

    The odd row of zeros goes behind.
    """
    pads: list[int] = []
    for size, k, s in zip(reversed(x.shape[2:]), reversed(kernel), reversed(stride), strict=True):
        total = max((-(-size // s) - 1) * s + k - size, 0)
        pads += [total // 2, total - total // 2]
    return functional.pad(x, pads) if any(pads) else torch.as_tensor(x)
