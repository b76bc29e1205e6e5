"""Completion of what is known to move to whole outlines.

Parallax shows movement only where there is texture, and above the horizon not at all. What stands in between
(dark windows, plain doors, roofs) moves as its surroundings do: from the part that is known the motion of the
thing follows, and every pixel near it is asked whether that motion or the static street explains it better.
Where both do, its edges in the picture decide.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive import _native
from dreamdrive.geometry.depth import PosedFrames, Warp, inside, sample
from dreamdrive.geometry.moving.flow import PairFlow, pixel_grid
from dreamdrive.vision.windows import window_px

_REACH = 2  # offsets beyond this are not asked
_SAME_PX = 2.0  # explanations that land this near are one
_PLANE_SHARE = 0.8
_MIN_FLOW_PX = 30  # pixels with trusted flow from which a motion is drawn
_MIN_SHARE = 0.4  # of them that have to follow it
_FOLLOWS_PX = 1.0
TALLEST_M = 3.8  # of road users
_SIDE_SHARE = 0.35  # of the width is looked at on both sides
_UP_OF_HEIGHT = 0.9  # and above, where nothing tells the size
_UP_OF_WIDTH = 0.45
_BELOW_SHARE = 0.1
_WORTH = 0.5  # of a grey level by which the motion explains a pixel better
_MAX_LEVELS = 12.0
_KNOWN = 1.0  # worth of a pixel that is known to move
_AWAY = 1.0  # cost of one that is not, unless it is above one that is: bare road fits both explanations
_UNDER = 1.0  # cost of a pixel below the region
_NEVER = 100.0
_EDGE = 6.0  # weight of two equal neighbours
_EDGE_FLOOR = 0.3
_CAP_LEVELS, _WINDOW_PX = 25.0, 3  # of a misfit
_UNIT = 100  # cuts are found in whole numbers
_EDGE_LEVELS = 15.0  # difference in colour at which the weight is 0.6 of that


Window = tuple[slice, slice]
"""Rows and columns of a picture, which may reach beyond its lower and right edges."""


def outline(
    view: PosedFrames,
    frame: int,
    flows: Sequence[PairFlow],
    inverse_depth: Float[np.ndarray, "h w"],
    flagged: Bool[np.ndarray, "h w"],
    sky: Bool[np.ndarray, "h w"],
) -> Bool[np.ndarray, "h w"]:
    """The moving things of which ``flagged`` shows a part; what has no motion of its own stays so.

    Some of what is flagged may be wrong; the sky is never part of a thing. Static depth is in 1/m.
    """
    if not flagged.any():
        return flagged.copy()
    near = [flow for flow in flows if abs(flow.offset) <= _REACH]
    count, found, stats, _ = cv2.connectedComponentsWithStats(flagged.astype(np.uint8))
    labels = np.asarray(found, np.intp)
    whole = np.zeros_like(flagged)
    for label in range(1, count):
        region = labels == label
        window = _window(view, frame, stats[label])
        around, inner = _with_rim(window, window_px(_WINDOW_PX, region.shape[1]) // 2)
        gain = _gain(view, frame, near, inverse_depth, region, around)
        if gain is None:
            whole |= region
            continue
        part = region[window]
        worth = gain[inner] + _prior(part, window, stats[label])
        worth[sky[window] | ~view.usable[frame][window]] = -_NEVER
        cut = minimum_cut(worth, *_edges(view.rgb[frame][window]))
        whole[window] |= _hanging_together(cut, part)
    return whole


def _window(view: PosedFrames, frame: int, box: np.ndarray) -> Window:
    """Rows and columns that a thing may fill whose part has this bounding box (left, top, width, height)."""
    left, top, width, height = (int(value) for value in box[:4])
    bottom, middle = top + height - 1, left + width // 2
    up = max(_UP_OF_HEIGHT * height, _UP_OF_WIDTH * width)
    px_per_m = float(view.plane_inverse[frame][bottom, middle]) * view.cameras[frame].fy_px
    if px_per_m > 0:
        up = max(3.0, min(3 * up, TALLEST_M * px_per_m - height))
    side, under = max(4, round(_SIDE_SHARE * width)), max(2, round(_BELOW_SHARE * height))
    rows = slice(max(0, round(top - up)), bottom + 1 + under)
    return rows, slice(max(0, left - side), left + width + side)


def _with_rim(window: Window, rim_px: int) -> tuple[Window, Window]:
    """The window with a rim, as far as the picture has one, and where the window is in that."""
    rows, columns = (slice(max(0, each.start - rim_px), each.stop + rim_px) for each in window)
    inner = (slice(a.start - b.start, a.stop - b.start) for a, b in zip(window, (rows, columns), strict=True))
    return (rows, columns), (next(inner), next(inner))


def _gain(
    view: PosedFrames,
    frame: int,
    near: Sequence[PairFlow],
    inverse_depth: Float[np.ndarray, "h w"],
    region: Bool[np.ndarray, "h w"],
    window: Window,
) -> Float[np.ndarray, "u v"] | None:
    """What the region's own motion, if it has one, is worth in the window over that of the static street."""
    camera = view.cameras[frame].cropped(*window)
    inverse, plane = inverse_depth[window], view.plane_inverse[frame][window]
    static = inverse, np.maximum(inverse, np.float32(_PLANE_SHARE) * plane), plane
    gains: list[np.ndarray] = []
    for flow in near:
        motion = _motion(flow, region, window)
        if motion is None:
            continue
        x, y = motion
        own = _misfit(view, frame, flow.source, window, x, y)
        warp, least = Warp(camera, view.cameras[flow.source]), np.full(own.shape, np.float32(np.inf))
        for each in static:
            at_x, at_y = warp(each)
            apart = np.hypot(at_x - x, at_y - y) >= _SAME_PX
            error = _misfit(view, frame, flow.source, window, at_x, at_y)
            least = np.where(apart, np.fmin(least, error), least)
        gain = np.clip(least - own, -_MAX_LEVELS, _MAX_LEVELS)
        gains.append(np.where(np.isfinite(least), gain, np.float32(np.nan)))
    if not gains:
        return None
    known = np.isfinite(gains)
    mean = np.where(known, gains, 0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return (_WORTH * mean).astype(np.float32)


def _motion(
    flow: PairFlow, region: Bool[np.ndarray, "h w"], window: Window
) -> tuple[np.ndarray, np.ndarray] | None:
    """Where the window's pixels would go with the affine motion that most of the region follows."""
    rows, columns = np.nonzero(region & flow.trusted)
    if len(rows) < _MIN_FLOW_PX:
        return None
    here = np.stack([columns, rows], axis=1).astype(np.float32)
    there = np.stack([flow.x[rows, columns], flow.y[rows, columns]], axis=1)
    cv2.setRNGSeed(0)
    affine, follows = cv2.estimateAffine2D(here, there, method=cv2.RANSAC, ransacReprojThreshold=_FOLLOWS_PX)
    if follows.mean() < _MIN_SHARE:  # also where none was found at all
        return None
    x, y = (each[window] for each in pixel_grid(*region.shape))
    a = affine.astype(np.float32)
    return a[0, 0] * x + a[0, 1] * y + a[0, 2], a[1, 0] * x + a[1, 1] * y + a[1, 2]


def _prior(part: Bool[np.ndarray, "u v"], window: Window, box: np.ndarray) -> Float[np.ndarray, "u v"]:
    """What a pixel is worth by its place alone: nothing above the region, less beside and below it."""
    top, height = int(box[1]), int(box[3])
    rows = np.arange(window[0].start, window[0].start + len(part))[:, None]
    above = np.atleast_2d(part.any(axis=0)) & (rows <= top + height // 2)
    worth = np.where(part, _KNOWN, np.where(above, 0, -_AWAY))
    return (worth - np.where(rows >= top + height, _UNDER, 0)).astype(np.float32)


def _edges(rgb: UInt8[np.ndarray, "u v 3"]) -> tuple[Float[np.ndarray, "u _"], Float[np.ndarray, "_ v"]]:
    """Weights of neighbours on the right and below: small across edges of the picture."""
    colour = rgb.astype(np.float32)

    def weight(difference: np.ndarray) -> np.ndarray:
        square = np.square(difference).sum(axis=-1)
        return _EDGE_FLOOR + _EDGE * np.exp(-square / (2 * _EDGE_LEVELS**2))

    return weight(np.diff(colour, axis=1)), weight(np.diff(colour, axis=0))


def _hanging_together(cut: Bool[np.ndarray, "u v"], part: Bool[np.ndarray, "u v"]) -> Bool[np.ndarray, "u v"]:
    """The pieces of the cut that touch the part."""
    _, found = cv2.connectedComponents(cut.astype(np.uint8), connectivity=4)
    labels = np.asarray(found, np.intp)
    return cut & np.isin(labels, np.unique(labels[part & cut]))


def _misfit(
    view: PosedFrames,
    frame: int,
    other: int,
    window: Window,
    x: Float[np.ndarray, "u v"],
    y: Float[np.ndarray, "u v"],
) -> Float[np.ndarray, "u v"]:
    """How badly a frame fits another one where its window's pixels are said to have gone, by column and row.

    Mean difference in grey levels over a small window, capped; NaN outside the other frame.
    """
    difference = np.abs(sample(view.grey[other], x, y) - view.grey[frame][window])
    side = window_px(_WINDOW_PX, view.grey.shape[2])
    mean = cv2.boxFilter(np.minimum(difference, np.float32(_CAP_LEVELS)), cv2.CV_32F, (side, side))
    return np.where(inside(x, y, view.usable[other]), mean, np.float32(np.nan))


def minimum_cut(
    gain: Float[np.ndarray, "h w"],
    right: Float[np.ndarray, "h v"],
    below: Float[np.ndarray, "u w"],
) -> Bool[np.ndarray, "h w"]:
    """The labels with the largest sum of gains of the labelled pixels less the weights that are cut.

    Two labels for every pixel, as a minimum cut (Boykov and Jolly, 2001). A gain is what labelling a pixel is
    worth; negative where it costs. Non-negative weights are those of unlike labels of each pixel and its
    neighbour on the right or below. Gains and weights count in steps of 1/100. Of equally good labellings it
    is that of the fewest pixels.
    """
    labelled = np.empty(gain.shape, bool)
    _native.minimum_cut(_whole(gain), _whole(right), _whole(below), labelled)
    return labelled


def _whole(values: np.ndarray) -> np.ndarray:
    return np.rint(values * _UNIT).astype(np.int32)
