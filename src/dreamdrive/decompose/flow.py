"""Dense optical flow between the frames that may be seen."""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.scene.clip import Clip


def grey(frame: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w"]:
    """Luma of an RGB frame."""
    return cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY)


def carried(points: Float[np.ndarray, "m 2"], flow: Float[np.ndarray, "h w 2"]) -> Float[np.ndarray, "m 2"]:
    """Where flow takes points (column, row); points outside move like the nearest pixel of the border."""
    column = points[:, 0].astype(int).clip(0, flow.shape[1] - 1)
    row = points[:, 1].astype(int).clip(0, flow.shape[0] - 1)
    return points + flow[row, column]


def neighbour_flow(
    clip: Clip, frame: int, other: int, start: Float[np.ndarray, "h w 2"] | None = None
) -> Float[np.ndarray, "h w 2"]:
    """Where each pixel of ``frame`` lies in ``other``, minus where it is, in pixels (DIS, medium preset).

    The search goes out from ``start``, or from no motion.
    """
    method = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    guess = np.zeros((*clip.frames.shape[1:3], 2), np.float32) if start is None else start.copy()
    return np.asarray(method.calc(grey(clip.frames[frame]), grey(clip.frames[other]), guess))
