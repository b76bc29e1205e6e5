"""How badly a frame fits another one where its pixels are said to have gone."""

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.geometry.depth import View, inside, sample

_CAP = 25.0  # grey levels
_WINDOW_PX = 3


def misfit(
    view: View, frame: int, other: int, x: Float[np.ndarray, "h w"], y: Float[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w"]:
    """Mean difference in grey levels over a small window, capped; NaN outside the other frame.

    Columns and rows in the other frame are in pixel indices.
    """
    difference = np.minimum(np.abs(sample(view.grey[other], x, y) - view.grey[frame]), np.float32(_CAP))
    mean = cv2.boxFilter(difference, cv2.CV_32F, (_WINDOW_PX, _WINDOW_PX))
    return np.where(inside(x, y, view.usable[other]), mean, np.float32(np.nan))
