"""Dense optical flow between the frames that may be seen."""

from collections.abc import Generator
from contextlib import contextmanager

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.scene.clip import Clip


@contextmanager
def single_threaded_opencv() -> Generator[None]:
    """Keep OpenCV on one thread: DIS flow depends on the number of stripes it is cut into."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


def grey(frame: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w"]:
    """Luma of an RGB frame."""
    return cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY)


def cells(
    points: Float[np.ndarray, "m c"], shape: tuple[int, ...]
) -> tuple[Int[np.ndarray, " m"], Int[np.ndarray, " m"]]:
    """Row and column of points (column, row, ...) in a picture (H, W); of those outside, at its border."""
    column, row = np.floor(points[:, :2]).astype(np.intp).T
    return row.clip(0, shape[0] - 1), column.clip(0, shape[1] - 1)


def carried(points: Float[np.ndarray, "m 2"], flow: Float[np.ndarray, "h w 2"]) -> Float[np.ndarray, "m 2"]:
    """Where flow takes points (column, row); points outside move like the nearest pixel of the border."""
    return points + flow[cells(points, flow.shape[:2])]


def neighbour_flow(
    clip: Clip, frame: int, other: int, start: Float[np.ndarray, "h w 2"] | None = None
) -> Float[np.ndarray, "h w 2"]:
    """Where each pixel of ``frame`` lies in ``other``, minus where it is, in pixels (DIS, medium preset).

    The search goes out from ``start``, or from no motion.
    """
    method = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    guess = np.zeros((*clip.frames.shape[1:3], 2), np.float32) if start is None else start.copy()
    return np.asarray(method.calc(grey(clip.frames[frame]), grey(clip.frames[other]), guess))


def in_between(clip: Clip, before: int, frame: int, after: int) -> Float[np.ndarray, "h w 3"]:
    """What two frames make of one between them: both carried along optical flow, blended by distance in time.

    Colours are in [0, 1]. The flows to the time in between are those of Jiang et al. 2018 (Super SloMo),
    eq. 4.
    """
    times = clip.times_s
    return blended(
        clip, before, after, float((times[frame] - times[before]) / (times[after] - times[before]))
    )


def blended(clip: Clip, before: int, after: int, t: float) -> Float[np.ndarray, "h w 3"]:
    """What two frames make of one at a share t of the time between them; see ``in_between``."""
    there, back = neighbour_flow(clip, before, after), neighbour_flow(clip, after, before)
    from_first = _warped(clip.frames[before], -(1 - t) * t * there + t * t * back)
    from_second = _warped(clip.frames[after], (1 - t) * (1 - t) * there - t * (1 - t) * back)
    return (1 - t) * from_first + t * from_second


def _warped(
    image: UInt8[np.ndarray, "h w 3"], offset_px: Float[np.ndarray, "h w 2"]
) -> Float[np.ndarray, "h w 3"]:
    height, width = image.shape[:2]
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    warped = cv2.remap(
        image.astype(np.float32) / 255,
        x + offset_px[..., 0].astype(np.float32),
        y + offset_px[..., 1].astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(warped)


_LEAST_SIDE_PX, _LARGEST = 64, 3.0  # of what flow is looked for in, and by how much it is enlarged for that
_STIFF = 0.02  # how far a warp keeps to one factor: share of the spread of points
_RETURNS_PX = 1.0  # flow there and back misses by less where it can be trusted


def guided(
    first: UInt8[np.ndarray, "h w"],
    second: UInt8[np.ndarray, "h w"],
    points: Float[np.ndarray, "m 2"],
    expected: Float[np.ndarray, "m 2"],
) -> tuple[Float[np.ndarray, "m 2"], Bool[np.ndarray, " m"]]:
    """Where the points of a thing are in another picture, which is looked for around where they are expected.

    The second picture is moved and stretched so that the thing should stay in place; flow is then small, and
    found in a cut around the thing. With the places it is told where the flow back leads to the start again.
    """
    middle, there = points.mean(axis=0), expected.mean(axis=0)
    way = _warp(points - middle, expected - there)
    low, high = points.min(axis=0), points.max(axis=0)
    margin = np.maximum(0.3 * (high - low), 8.0)
    corner, size = low - margin, high - low + 2 * margin
    enlarged = min(max(_LEAST_SIDE_PX / float(size.min()), 1.0), _LARGEST)
    shape = int(np.ceil(size[0] * enlarged)), int(np.ceil(size[1] * enlarged))
    # From the cut to each picture, in coordinates in which the middle of the first pixel is 0.
    to_first = np.array([[1 / enlarged, 0, corner[0] - 0.5], [0, 1 / enlarged, corner[1] - 0.5]])
    to_second = np.column_stack([way / enlarged, there + way @ (corner - middle) - 0.5])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    one, other = (
        cv2.warpAffine(picture, matrix, shape, flags=flags, borderMode=cv2.BORDER_REPLICATE)
        for picture, matrix in ((first, to_first), (second, to_second))
    )
    method = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    still = np.zeros((*one.shape, 2), np.float32)
    ahead, back = (np.asarray(method.calc(a, b, still.copy())) for a, b in ((one, other), (other, one)))
    start = (points - corner) * enlarged
    end = carried(start, ahead)
    trusted = np.linalg.norm(carried(end, back) - start, axis=1) < _RETURNS_PX * enlarged
    return there + (end / enlarged + corner - middle) @ way.T, trusted & (end >= 0).all(axis=1) & (
        end < shape
    ).all(axis=1)


def _warp(points: Float[np.ndarray, "m 2"], expected: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, "2 2"]:
    """The linear map that brings points next to where they are expected; both are about their middles.

    One factor, unless the points spread in both directions.
    """
    spread = float((points**2).sum())
    scale = min(max(float((points * expected).sum()) / spread, 0.3), 3.0) if spread > 0 else 1.0
    ridge = _STIFF * max(spread, 1.0) * np.eye(2)
    return np.linalg.solve(points.T @ points + ridge, points.T @ expected + scale * ridge).T
