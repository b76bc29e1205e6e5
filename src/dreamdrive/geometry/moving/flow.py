"""Dense flow between posed frames, relative to the road plane and to infinity."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.compute.threads import parallel
from dreamdrive.geometry.depth import Correlation, PosedFrames, Warp, inside, sample

OFFSETS = (-4, -2, -1, 1, 2, 4)  # neighbours in the order of the used frames
_WINDOW_PX = 9
_FAR_CORRELATION = 0.7
_FAR_REACH = 2  # offsets beyond this are compared with the plane only, for speed
_FAR_LEAD = 0.2  # by which the flow from infinity must correlate better than that from the plane
_ROUND_TRIP_PX = 1.0
_ROUND_TRIP_SHARE = 0.05


@dataclass(frozen=True)
class PairFlow:
    """Column and row, in pixel indices, of the pixels of one frame in another, ``offset`` used frames away.

    Trusted is what is seen there and confirmed by the flow back.
    """

    offset: int
    source: int
    x: Float[np.ndarray, "h w"]
    y: Float[np.ndarray, "h w"]
    trusted: Bool[np.ndarray, "h w"]


def pixel_grid(height: int, width: int) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w"]]:
    """Pixel indices (x, y), float32."""
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    return x, y


def neighbour_flows(view: PosedFrames) -> dict[int, list[PairFlow]]:
    """Flow from every used frame to its neighbours at ``OFFSETS``."""
    frames = view.frames
    pairs = [
        (frame, frames[k + offset], offset)
        for k, frame in enumerate(frames)
        for offset in OFFSETS
        if 0 <= k + offset < len(frames)
    ]
    targets = parallel(lambda pair: _flow(view, *pair), pairs)
    by_pair = {pair[:2]: target for pair, target in zip(pairs, targets, strict=True)}
    checked = parallel(lambda pair: _checked(view, pair, by_pair), pairs)
    result: dict[int, list[PairFlow]] = {frame: [] for frame in frames}
    for (frame, _, _), flow in zip(pairs, checked, strict=True):
        result[frame].append(flow)
    return result


def _flow(view: PosedFrames, frame: int, other: int, offset: int) -> tuple[np.ndarray, np.ndarray]:
    """DIS flow after warping ``other`` by the road plane, and where that matches clearly better, by infinity.

    Bare asphalt then defaults to lying still on the plane, and the large flow of the near road need not be
    found. What moves along with the camera is nearer to the motion of infinity.
    """
    x, y = _flow_from(view, frame, other, view.plane_inverse[frame])
    if abs(offset) > _FAR_REACH or not view.plane_inverse[frame].any():
        return x, y
    far_x, far_y = _flow_from(view, frame, other, np.zeros_like(view.plane_inverse[frame]))
    correlation, grey = Correlation(view.grey[frame], _WINDOW_PX), view.grey[other]
    far = correlation(sample(grey, far_x, far_y))
    better = (far > _FAR_CORRELATION) & (far > correlation(sample(grey, x, y)) + _FAR_LEAD)
    return np.where(better, far_x, x), np.where(better, far_y, y)


def _flow_from(
    view: PosedFrames, frame: int, other: int, inverse_depth: Float[np.ndarray, "h w"]
) -> tuple[np.ndarray, np.ndarray]:
    map_x, map_y = Warp(view.cameras[frame], view.cameras[other])(inverse_depth)
    warped = sample(view.grey[other], map_x, map_y)
    estimator = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    start = np.zeros((*warped.shape, 2), np.float32)
    flow = estimator.calc(view.grey[frame].astype(np.uint8), np.rint(warped).astype(np.uint8), start)
    x, y = pixel_grid(*warped.shape)
    x, y = x + flow[..., 0], y + flow[..., 1]
    return sample(map_x, x, y), sample(map_y, x, y)


def _checked(
    view: PosedFrames,
    pair: tuple[int, int, int],
    by_pair: dict[tuple[int, int], tuple[np.ndarray, np.ndarray]],
) -> PairFlow:
    frame, other, offset = pair
    x, y = by_pair[frame, other]
    back_x, back_y = by_pair[other, frame]
    home_x, home_y = pixel_grid(*x.shape)
    miss = np.hypot(sample(back_x, x, y) - home_x, sample(back_y, x, y) - home_y)
    length = np.hypot(x - home_x, y - home_y)
    trusted = (miss < _ROUND_TRIP_PX + _ROUND_TRIP_SHARE * length) & inside(x, y, view.usable[other])
    return PairFlow(offset, other, x, y, trusted & view.usable[frame])
