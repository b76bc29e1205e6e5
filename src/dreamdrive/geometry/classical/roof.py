"""The upper part of moving things, which parallax cannot tell from what is far behind it."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

_UP_OF_HEIGHT = 0.9
_CAR_HEIGHT_M = 2.0
_UP_OF_WIDTH = 0.45
_LIKELY_SHARE = 0.5  # of the way up that is taken for the thing until the colours say otherwise
_SIDE_SHARE = 6  # a sixth of the width is looked at on both sides, as background
_MIN_COLUMNS = 4
_MIN_BACKGROUND_PX = 20
_MARGIN_PX = 2
_ROUNDS = 2


def grow_upwards(
    rgb: UInt8[np.ndarray, "h w 3"],
    flagged: Bool[np.ndarray, "h w"],
    sky: Bool[np.ndarray, "h w"],
    px_per_m: Float[np.ndarray, "h w"],
) -> Bool[np.ndarray, "h w"]:
    """Flagged regions with their roofs (H, W), by colour: GrabCut (Rother et al., 2004) of a band above each.

    The band is 0.9 of a region's height or 0.45 of its width high, whichever is more, over the columns of the
    region's upper half, but ends where a car standing at the region's lower edge does. Nothing flagged is
    given up, and only what hangs together with it is added.

    Args:
        rgb: The picture.
        flagged: Pixels known to move.
        sky: Never part of a thing.
        px_per_m: Size in the picture of a metre that stands on the road at each pixel; 0 where unknown.
    """
    grown = flagged.copy()
    count, found, stats, _ = cv2.connectedComponentsWithStats(flagged.astype(np.uint8))
    labels = np.asarray(found, np.intp)
    for label in range(1, count):
        left, top, width, height = (int(value) for value in stats[label, :4])
        up = round(max(_UP_OF_HEIGHT * height, _UP_OF_WIDTH * width))
        scale = float(px_per_m[top + height - 1, left + width // 2])
        up = min(up, max(0, round(_CAR_HEIGHT_M * scale) - height)) if scale > 0 else up
        side = max(3, width // _SIDE_SHARE)
        rows = slice(max(0, top - up), top + height)
        columns = slice(max(0, left - side), left + width + side)
        region = labels[rows, columns] == label
        marks = _marks(region, top - rows.start, height, up, sky[rows, columns])
        if marks is not None:
            grown[rows, columns] |= _cut(np.ascontiguousarray(rgb[rows, columns]), marks, region)
    return grown


def _marks(
    region: Bool[np.ndarray, "h w"], above: int, height: int, up: int, sky: Bool[np.ndarray, "h w"]
) -> UInt8[np.ndarray, "h w"] | None:
    """GrabCut's first guess, or None where there is no room above or no background to learn from."""
    upper = region[: above + max(1, height // 2)].any(axis=0)
    if upper.sum() < _MIN_COLUMNS or above < _MARGIN_PX:
        return None
    start = np.where(upper, region.argmax(axis=0), 0)
    rows = np.arange(len(region))[:, None]
    band = rows < start
    marks = np.full(region.shape, cv2.GC_BGD, np.uint8)
    marks[band] = cv2.GC_PR_BGD
    marks[band & (rows >= start - max(2, round(_LIKELY_SHARE * up)))] = cv2.GC_PR_FGD
    marks[region] = cv2.GC_FGD
    marks[:_MARGIN_PX] = cv2.GC_BGD
    marks[sky & ~region] = cv2.GC_BGD
    return marks if (marks == cv2.GC_BGD).sum() >= _MIN_BACKGROUND_PX else None


def _cut(
    rgb: UInt8[np.ndarray, "h w 3"], marks: UInt8[np.ndarray, "h w"], region: Bool[np.ndarray, "h w"]
) -> Bool[np.ndarray, "h w"]:
    cv2.setRNGSeed(0)  # of this thread: GrabCut's colour clusters start at random
    model = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(rgb, marks, (0, 0, 1, 1), *model, _ROUNDS, cv2.GC_INIT_WITH_MASK)
    added = ((marks == cv2.GC_FGD) | (marks == cv2.GC_PR_FGD)) & ~region
    opened = np.asarray(cv2.morphologyEx(added.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)))
    _, found = cv2.connectedComponents(((opened > 0) | region).astype(np.uint8), connectivity=4)
    labels = np.asarray(found, np.intp)
    return np.isin(labels, np.unique(labels[region]))
