"""Features Z_ref of the early layers of a video model's UNet: which block, and how they lie on the frames."""

from collections.abc import Callable, Sequence
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float16
from torch import Tensor, nn

BLOCK = "down_blocks.1.attentions.1"
"""The second level, behind its last transformer: 1/16 of the frame's size."""
SIGMA = 0.3
"""Standard deviation of the noise on the latents, whose own is about 1, when the UNet looks at frames."""


def watch(network: nn.Module, name: str, keep: Callable[[Tensor], None]) -> Any:
    """Hand over what a block such as ``BLOCK`` makes each time it runs (B, C, h, w).

    What comes back is to be removed afterwards by its ``remove()``.
    """

    def hand_over(module: nn.Module, args: object, output: Any) -> None:
        keep(output if isinstance(output, Tensor) else output[0])

    return network.get_submodule(name).register_forward_hook(hand_over)


def onto_frames(
    values: Float16[np.ndarray, "f h w c"], size: tuple[int, int]
) -> tuple[Float16[np.ndarray, "f h2 w2 c"], Sequence[str]]:
    """The features on a grid that divides frames of a width and height, and what to say about it."""
    height, width = (_divisor(side, own) for side, own in zip(size[::-1], values.shape[1:3], strict=True))
    if (height, width) == values.shape[1:3]:
        return values, ()
    resized = [
        np.asarray(cv2.resize(one.astype(np.float32), (width, height)), dtype=np.float16) for one in values
    ]
    note = (
        f"The features of the video model are resized from {values.shape[2]}x{values.shape[1]} to "
        f"{width}x{height}, which divides the frames."
    )
    return np.stack(resized).reshape(len(values), height, width, -1), (note,)


def _divisor(side: int, wanted: int) -> int:
    """The divisor of a side that is nearest to the wanted number, as a multiple of it or a part."""
    divisors = (n for n in range(1, side + 1) if side % n == 0)
    return min(divisors, key=lambda n: (max(n / wanted, wanted / n), -n))
