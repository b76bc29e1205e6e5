"""Outlines of depth maps moved to those of the picture, by colour."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive import _native
from dreamdrive.geometry.depth.view import PosedFrames, by_frame
from dreamdrive.vision.windows import grown, window_px

_STEP = 0.1  # of log depth between neighbours: an outline
_NEAR_PX = 2  # of an outline: pixels that are drawn again
_SAMPLES = 3  # to each side, along both axes
_REACH_PX = 9.0  # of the farthest of them
_FALL_PX = 5.0  # standard deviation of their weight over the distance
_COLOUR = 0.06  # and over the colour, each channel in [0, 1]


def with_outlines(
    view: PosedFrames, inverse: Float[np.ndarray, "f h w"], free: Bool[np.ndarray, "f h w"]
) -> Float[np.ndarray, "f h w"]:
    """Inverse depth in 1/m of all frames, with the outlines of things where colours change.

    Pixels that are not free keep theirs.

    Near a jump of depth each pixel takes the weighted median around it, and pixels of its own colour count
    (Ma et al. 2013, constant time weighted median filtering). Networks and windows blur outlines by a pixel
    or two, on which a tenth of a street's pixels lie.
    """
    drawn = inverse.copy()
    found = by_frame(view, lambda frame: redrawn(inverse[frame], view.rgb[frame], free[frame]))
    for frame, each in found.items():
        drawn[frame] = each
    return drawn


def redrawn(
    inverse: Float[np.ndarray, "h w"], rgb: UInt8[np.ndarray, "h w 3"], free: Bool[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w"]:
    """The same of one frame. Pixels without depth, 0, keep none and tell nothing."""
    width = inverse.shape[1]
    level = np.log(np.maximum(inverse, 1e-6)).astype(np.float32)
    jump = cv2.dilate(level, np.ones((3, 3))) - cv2.erode(level, np.ones((3, 3))) > _STEP
    side = window_px(2 * _NEAR_PX + 1, width)
    near = cv2.dilate(jump.astype(np.uint8), np.ones((side, side), np.uint8)) > 0
    row, column = np.nonzero(near & free & (inverse > 0))
    if not len(row):
        return inverse
    step = max(1, round(grown(_REACH_PX, width) / _SAMPLES))
    reach = step * _SAMPLES
    channels = [np.pad(rgb[..., c], reach, mode="edge").ravel().astype(np.float32) for c in range(3)]
    depth = np.pad(level, reach).ravel()
    known = np.pad((inverse > 0).astype(np.float32), reach).ravel()
    line = width + 2 * reach
    at = (row + reach) * line + column + reach
    values = np.empty(((2 * _SAMPLES + 1) ** 2, len(at)), np.float32)
    weight = np.empty_like(values)
    own = [channel[at] for channel in channels]
    offsets = range(-reach, reach + 1, step)
    fall, spread = grown(_FALL_PX, width), 255 * _COLOUR
    for k, (down, right) in enumerate((a, b) for a in offsets for b in offsets):
        there = at + down * line + right
        unlike = sum((each[there] - mine) ** 2 for each, mine in zip(channels, own, strict=True)) / spread**2
        weight[k] = np.exp(-(unlike + (down**2 + right**2) / fall**2) / 2) * known[there]
        values[k] = depth[there]
    drawn = inverse.copy()
    drawn[row, column] = np.exp(weighted_median(values, weight))
    return drawn


def weighted_median(
    values: Float[np.ndarray, "n *shape"], weight: Float[np.ndarray, "n *shape"]
) -> Float[np.ndarray, "*shape"]:
    """Along the first axis: the least value that, with all that are no greater, has half of the weight."""
    median = np.empty(values.shape[1:], np.float32)
    contiguous = [np.ascontiguousarray(each, np.float32) for each in (values, weight)]
    _native.weighted_median(contiguous[0], contiguous[1], median)
    return median
