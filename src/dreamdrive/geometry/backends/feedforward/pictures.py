"""Pictures for networks that cut them into patches of 14 pixels."""

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from dreamdrive.geometry.fitting import Fitting, prepare

_PATCH_PX = 14
_MEAN = (0.485, 0.456, 0.406)
_DEVIATION = (0.229, 0.224, 0.225)


def fit_patches(width_px: int, height_px: int, long_side_px: int) -> Fitting:
    """How frames are resized to whole patches: a little stretched, nothing cut off.

    The long side, a multiple of 14, is given; the other takes the nearest multiple.
    """
    longest = max(width_px, height_px)
    width, height = (
        max(_PATCH_PX, round(side * long_side_px / longest / _PATCH_PX) * _PATCH_PX)
        for side in (width_px, height_px)
    )
    return Fitting((width_px, height_px), (width, height), 0, 0, (width, height), longest > long_side_px)


def show(frames: UInt8[np.ndarray, "n h w 3"], how: Fitting) -> Float[Tensor, "n 3 u v"]:
    """The pictures (N, 3, U, V) in [0, 1] of frames (N, H, W, 3)."""
    pictures = np.stack([prepare(frame, how) for frame in frames])
    return torch.from_numpy(pictures).permute(0, 3, 1, 2).float().div(255)


def standardise(pictures: Float[Tensor, "n 3 h w"]) -> Float[Tensor, "n 3 h w"]:
    """Pictures in [0, 1] with mean and deviation of ImageNet's taken out, as DINOv2 was trained."""
    mean, deviation = (pictures.new_tensor(values)[:, None, None] for values in (_MEAN, _DEVIATION))
    return (pictures - mean) / deviation
