"""Sizes of the pictures that the network takes.

It knows a few shapes only: the long side is brought to a fixed length, then the middle is cut out so that
both sides are multiples of 16.
"""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.geometry.resize import ResizeCrop

SQUARE_SIZE = 224
"""At this size the network takes squares; at all others the long side has the given length."""
_MULTIPLE = 16


def resize_crop(width_px: int, height_px: int, size: int = 512) -> ResizeCrop:
    """How frames are brought to the size of the network: the length of the long side, or 224 for squares.

    Raises:
        InputError: Nothing would be left of one side, or a side would be no multiple of 16.
    """
    if min(width_px, height_px) < 1 or size < _MULTIPLE:
        raise InputError(f"frames of {width_px}x{height_px} px cannot be brought to {size} px")
    found = any_resize_crop(width_px, height_px, size)
    picture = found.size
    if min(picture) < _MULTIPLE or picture[0] % _MULTIPLE or picture[1] % _MULTIPLE:
        raise InputError(
            f"frames of {width_px}x{height_px} px become {picture[0]}x{picture[1]} px at size {size}; "
            f"both sides have to be multiples of {_MULTIPLE}: choose another size (512, 224) or shape"
        )
    return found


def any_resize_crop(width_px: int, height_px: int, size: int, *, square_ok: bool = False) -> ResizeCrop:
    """The same rule, whether or not the network takes the picture.

    Square frames stay square if that is asked for; otherwise they are cut to 4:3, as in training.
    """
    shortest, longest = sorted((width_px, height_px))
    long_side = round(SQUARE_SIZE * longest / shortest) if size == SQUARE_SIZE else size
    resized = (round(width_px * long_side / longest), round(height_px * long_side / longest))
    middle = (resized[0] // 2, resized[1] // 2)
    half = [min(middle)] * 2
    if size != SQUARE_SIZE:
        half = [side // 2 * 2 // _MULTIPLE * (_MULTIPLE // 2) for side in resized]
        if resized[0] == resized[1] and not square_ok:
            half[1] = 3 * half[0] // 4
    return ResizeCrop(
        (width_px, height_px),
        resized,
        middle[0] - half[0],
        middle[1] - half[1],
        (2 * half[0], 2 * half[1]),
        shrinks=longest > long_side,
    )


def as_input(pictures: Sequence[UInt8[np.ndarray, "h w 3"]]) -> Float[Tensor, "n 3 h w"]:
    """Pictures of one shape as the network reads them, in [-1, 1]."""
    return torch.from_numpy(np.stack(pictures)).permute(0, 3, 1, 2).float().div(127.5).sub(1)
