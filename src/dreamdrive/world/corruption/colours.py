"""Corruptions that change colours: texture that swims, light that flickers, colours that drift."""

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.world.corruption.noise import Noise
from dreamdrive.world.corruption.shapes import moved

_FINE = 1 / 160
"""Standard deviation, over the width, of the blur that fine detail is left over from."""
_SWIM, _SWIM_CELLS, _SWIM_HOLD = 0.004, 40, 3
_GRAIN_CELLS, _GRAIN_HOLD = (
    128,
    2,
)  # a cell is what one latent pixel of the usual video autoencoder decodes to
_LOST, _GRAIN = 0.4, 0.45
_GAIN, _GAMMA, _PATCH, _PATCH_CELLS = 0.02, 0.04, 0.025, 3
_TINT, _CONTRAST, _SATURATION, _DRIFT_HOLD = 0.05, 0.08, 0.2, 12
_LUMA = np.array([0.299, 0.587, 0.114], np.float32)


def shimmer(
    picture: Float[np.ndarray, "h w 3"], strength: float, seed: int, frame: int
) -> Float[np.ndarray, "h w 3"]:
    """Fine detail displaced, partly lost, and replaced by grain as strong as the texture around it."""
    height, width = picture.shape[:2]
    coarse = cv2.GaussianBlur(picture, (0, 0), _FINE * width)
    detail = picture - coarse
    swim = Noise(seed, 4, 2, _SWIM_CELLS, _SWIM_HOLD).field(frame, height, width)
    kept = moved(detail, np.float32(strength * _SWIM * width / np.sqrt(2)) * swim)
    contrast = np.sqrt(cv2.GaussianBlur(np.square(detail @ _LUMA), (0, 0), _FINE * width))
    grain = Noise(seed, 5, 1, _GRAIN_CELLS, _GRAIN_HOLD).field(frame, height, width)[0]
    lost, added = min(1.0, strength * _LOST), strength * _GRAIN
    return coarse + np.float32(1 - lost) * kept + np.float32(added) * (contrast * grain)[..., None]


def flicker(
    picture: Float[np.ndarray, "h w 3"], strength: float, seed: int, frame: int
) -> Float[np.ndarray, "h w 3"]:
    """Exposure and gamma of one frame, and exposure that is uneven over the picture."""
    height, width = picture.shape[:2]
    whole = Noise(seed, 6, 2).values(frame)
    patch = Noise(seed, 7, 1, _PATCH_CELLS).field(frame, height, width)[0]
    gain = np.exp(np.float32(strength) * (_GAIN * whole[0] + _PATCH * patch))
    curved = cv2.pow(np.clip(picture, 0, 255) / np.float32(255), float(np.exp(strength * _GAMMA * whole[1])))
    return 255 * curved * gain[..., None]


def drift(
    picture: Float[np.ndarray, "h w 3"], strength: float, seed: int, frame: int
) -> Float[np.ndarray, "h w 3"]:
    """White balance, contrast and saturation as far as they have wandered since frame 0."""
    wander = Noise(seed, 8, 5, hold=_DRIFT_HOLD)
    way = np.float32(strength) * (wander.values(frame) - wander.values(0))
    tint = np.exp(_TINT * way[:3])
    contrast, saturation = np.exp(_CONTRAST * way[3]), np.exp(_SATURATION * way[4])
    grey = (picture @ _LUMA)[..., None]
    mixed = grey + saturation * (picture - grey)
    return (128 + contrast * (mixed - 128)) * tint
