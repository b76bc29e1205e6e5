"""Corruptions that move pixels: shapes that wobble, and a distance that slides."""

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.world.corruption.noise import Noise

# Amplitudes are RMS lengths over the width of the picture at strength 1.
_WOBBLE, _WOBBLE_CELLS, _WOBBLE_HOLD = 0.006, 6, 8
_JUMP, _JUMP_CELLS = 0.0015, 10
_SLIDE, _SLIDE_HOLD = 0.012, 12
_BEND, _BEND_CELLS, _BEND_HOLD = 0.006, 5, 8
_HALF_WAY_M = 25.0
_SEAM = 0.01
"""Blur, over the width, of where the sliding distance begins: what is drawn is stretched there, not torn."""


def wobble(seed: int, frame: int, height: int, width: int) -> Float[np.ndarray, "2 h w"]:
    """Displacement of ``warp`` at strength 1: right and down in pixels (2, H, W)."""
    slow = Noise(seed, 0, 2, _WOBBLE_CELLS, _WOBBLE_HOLD).field(frame, height, width)
    fast = Noise(seed, 1, 2, _JUMP_CELLS).field(frame, height, width)
    return (_WOBBLE * slow + _JUMP * fast) * np.float32(width / np.sqrt(2))


def slide(seed: int, frame: int, depth_m: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "2 h w"]:
    """Displacement of ``far`` at strength 1: right and down in pixels, from depth along z, 0 in the sky."""
    height, width = depth_m.shape
    square = np.square(depth_m, dtype=np.float32)
    share = np.where(depth_m > 0, square / (square + np.float32(_HALF_WAY_M**2)), np.float32(1))
    share = cv2.GaussianBlur(share.astype(np.float32), (0, 0), _SEAM * width)
    whole = Noise(seed, 2, 2, hold=_SLIDE_HOLD).values(frame)[:, None, None]
    local = Noise(seed, 3, 2, _BEND_CELLS, _BEND_HOLD).field(frame, height, width)
    return share * (_SLIDE * whole + _BEND * local) * np.float32(width / np.sqrt(2))


def moved(
    picture: Float[np.ndarray, "h w 3"], displacement_px: Float[np.ndarray, "2 h w"]
) -> Float[np.ndarray, "h w 3"]:
    """Each pixel shows what lies one displacement away; the border is mirrored."""
    height, width = picture.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    x, y = x + displacement_px[0], y + displacement_px[1]
    return cv2.remap(picture, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101)
