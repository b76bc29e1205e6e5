"""Zero padding of TensorFlow's ``SAME``, which may be uneven."""

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional


def pad_same(
    x: Float[Tensor, "n c *size"], kernel: tuple[int, ...], stride: tuple[int, ...]
) -> Float[Tensor, "n c *padded"]:
    """Pad so that a window of ``kernel`` in steps of ``stride`` gives ceil(size / stride) values per axis.

    The odd row of zeros goes behind.
    """
    pads: list[int] = []
    for size, k, s in zip(reversed(x.shape[2:]), reversed(kernel), reversed(stride), strict=True):
        total = max((-(-size // s) - 1) * s + k - size, 0)
        pads += [total // 2, total - total // 2]
    return functional.pad(x, pads) if any(pads) else torch.as_tensor(x)
