"""Depth of things that stand on the road, from where they touch it."""

import cv2
import numpy as np
from jaxtyping import Bool, Float

_SMOOTH_SHARE = 0.02  # of the image width: columns are smoothed over twice this and one more


def upright_depth(
    flagged: Bool[np.ndarray, "h w"], plane_inverse: Float[np.ndarray, "h w"]
) -> Float[np.ndarray, "h w"]:
    """Inverse depth in 1/m of flagged regions, each column upright on the road; 0 where none is known.

    The lowest flagged pixel of a region's column is its contact with the road, whose plane is 0 above the
    horizon; a running median over the columns takes out notches. A region cut off by the lower edge of the
    image comes out too far away.
    """
    height, width = flagged.shape
    reach = max(1, round(_SMOOTH_SHARE * width))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(flagged.astype(np.uint8))
    inverse = np.zeros(flagged.shape, np.float32)
    for label in range(1, count):
        left, span = stats[label, cv2.CC_STAT_LEFT], stats[label, cv2.CC_STAT_WIDTH]
        region = labels[:, left : left + span] == label
        lowest = height - 1 - region[::-1].argmax(axis=0)
        contact = plane_inverse[lowest, np.arange(left, left + span)]
        padded = np.pad(contact, reach, mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
        column = np.median(windows, axis=1).astype(np.float32)
        part = inverse[:, left : left + span]
        part[region] = np.broadcast_to(column, region.shape)[region]
    return inverse
