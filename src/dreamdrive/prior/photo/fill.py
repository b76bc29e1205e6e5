"""Inpainting of holes in pictures and maps from around them."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

_RADIUS_PX = 3.0
_LEAST_PX = 4  # sides of the coarsest picture


def grown(mask: Bool[np.ndarray, "h w"], side: int) -> Bool[np.ndarray, "h w"]:
    """The mask widened by a square of that side, an odd number of pixels."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((side, side))) > 0


def inpainted(rgb: UInt8[np.ndarray, "h w 3"], holes: Bool[np.ndarray, "h w"]) -> UInt8[np.ndarray, "h w 3"]:
    """The picture with its holes filled by OpenCV (Telea 2004), from the border inwards."""
    return cv2.inpaint(rgb, holes.astype(np.uint8), _RADIUS_PX, cv2.INPAINT_TELEA) if holes.any() else rgb


def smoothed(rgb: UInt8[np.ndarray, "h w 3"], holes: Bool[np.ndarray, "h w"]) -> UInt8[np.ndarray, "h w 3"]:
    """The picture with its holes filled smoothly, however large they are and as far as anything is known."""
    filled = np.rint(continued(rgb.astype(np.float32), (~holes).astype(np.float32)))
    return np.where(holes[..., None], np.clip(filled, 0, 255), rgb).astype(np.uint8)


def continued(
    values: Float[np.ndarray, "h w c"], weights: Float[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w c"]:
    """Values where they weigh, and smooth between and beyond these; 0 where nothing weighs at all.

    Means over ever larger windows fill what smaller ones leave empty (pull-push: Gortler et al. 1996).
    """
    weights = np.clip(weights, 0, 1).astype(np.float32)
    summed = values.astype(np.float32) * weights[..., None]
    if min(weights.shape) <= _LEAST_PX:
        return _mean(summed.reshape(-1, values.shape[2]).sum(0), np.array(weights.sum())) * np.ones_like(
            summed
        )
    half = cv2.pyrDown(weights), cv2.pyrDown(summed).reshape(*cv2.pyrDown(weights).shape, -1)
    coarse = continued(_mean(half[1], half[0]), np.minimum(4 * half[0], 1))
    back = cv2.resize(coarse, weights.shape[::-1], interpolation=cv2.INTER_LINEAR).reshape(summed.shape)
    return summed + (1 - weights[..., None]) * back


def _mean(summed: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return np.where(weight[..., None] > 1e-6, summed / np.maximum(weight[..., None], 1e-6), 0)
