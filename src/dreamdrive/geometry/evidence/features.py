"""Local features of grey frames for structure from motion."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

MAX_FEATURES = 1024
CONTRAST, FAINT = 0.01, 0.0025
MIN_WIDTH_PX, MAX_WIDTH_PX = 480, 640
MASK_MARGIN_PX = 4
LITTLE = 0.4
"""Usable share of a picture below which it is looked at more closely."""


@dataclass(frozen=True)
class Features:
    """SIFT features of one frame.

    Descriptors are RootSIFT as COLMAP stores it: square root of the L1-normalised vector times 512.
    """

    keypoints_px: Float[np.ndarray, "n 2"]  # pixel centres at +0.5
    descriptors: UInt8[np.ndarray, "n 128"]


def working_size(width_px: int, height_px: int) -> tuple[int, int]:
    """Size at which features are sought: the frame's own unless it is narrower than 480 or wider than 640."""
    width = min(max(width_px, MIN_WIDTH_PX), MAX_WIDTH_PX)
    return width, max(1, round(height_px * width / width_px))


def to_grey(frames: UInt8[np.ndarray, "f h w 3"], size: tuple[int, int]) -> UInt8[np.ndarray, "f _ _"]:
    """Grey frames of the given (width, height): area averaging when shrinking, bicubic when growing."""
    grey = [cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY) for frame in frames]
    if size == (frames.shape[2], frames.shape[1]):
        return np.stack(grey)
    how = cv2.INTER_AREA if size[0] < frames.shape[2] else cv2.INTER_CUBIC
    return np.stack([cv2.resize(frame, size, interpolation=how) for frame in grey])


def is_little(usable: Bool[np.ndarray, "h w"]) -> bool:
    """Whether so little of a picture is usable, as in a queue, that it shows few features."""
    return float(usable.mean()) < LITTLE


def scaled(found: Features, factor: float | Float[np.ndarray, "2"]) -> Features:
    """The features at places x and y times a factor."""
    return Features((found.keypoints_px * np.float32(factor)).astype(np.float32), found.descriptors)


def extract(
    grey: UInt8[np.ndarray, "f h w"], usable: Bool[np.ndarray, "f h w"], contrast: float = CONTRAST
) -> list[Features]:
    """SIFT (Lowe 2004) of each frame, away from unusable pixels, of a contrast or more.

    OpenCV's detector is six times as fast as COLMAP's and gives the same path to a tenth of a per cent; the
    precise upscaling avoids its quarter-pixel shift. Each frame is done by one thread, so the number of
    threads does not show in the result.
    """
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(partial(_extract_one, contrast=contrast), grey, usable))


def _extract_one(grey: np.ndarray, usable: np.ndarray, contrast: float) -> Features:
    kernel = np.ones((2 * MASK_MARGIN_PX + 1, 2 * MASK_MARGIN_PX + 1), np.uint8)
    mask = cv2.erode(usable.astype(np.uint8), kernel, borderType=cv2.BORDER_CONSTANT, borderValue=1)
    sift = cv2.SIFT.create(
        nfeatures=0, contrastThreshold=contrast, edgeThreshold=10, sigma=1.6, enable_precise_upscale=True
    )
    found, descriptors = sift.detectAndCompute(grey, mask)
    if len(found) == 0:
        return Features(np.zeros((0, 2), np.float32), np.zeros((0, 128), np.uint8))
    rows = np.array([(*point.pt, point.response, point.size, point.angle) for point in found], np.float64)
    order = np.lexsort((rows[:, 4], rows[:, 3], rows[:, 1], rows[:, 0], -rows[:, 2]))[:MAX_FEATURES]
    root = np.sqrt(descriptors[order] / np.maximum(descriptors[order].sum(1, keepdims=True), 1e-9))
    return Features(
        (rows[order, :2] + 0.5).astype(np.float32), np.clip(np.rint(512 * root), 0, 255).astype(np.uint8)
    )
