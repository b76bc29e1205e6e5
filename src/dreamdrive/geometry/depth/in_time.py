"""Temporal consistency: depth maps of neighbouring frames agree on what stands still."""

import cv2
import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.depth.outlines import weighted_median
from dreamdrive.geometry.depth.sweep import Warp
from dreamdrive.geometry.depth.view import PosedFrames, by_frame

_STEPS = (-4, -2, -1, 1, 2, 4)
"""Neighbours asked, in used frames."""
_ALIKE = 0.4  # of log depth: farther apart two maps show different things
_LEAST_SPREAD = 0.01


def settled_in_time(
    view: PosedFrames,
    inverse: Float[np.ndarray, "f h w"],
    spread: Float[np.ndarray, "f h w"],
    still: Bool[np.ndarray, "f h w"],
) -> Float[np.ndarray, "f h w"]:
    """Inverse depth of all frames, where what stands still has what its neighbours make of it, too."""
    settled = inverse.copy()
    found = by_frame(view, lambda frame: _settled(frame, view, inverse, spread, still))
    for frame, each in found.items():
        settled[frame] = each
    return settled


def _settled(
    frame: int,
    view: PosedFrames,
    inverse: Float[np.ndarray, "f h w"],
    spread: Float[np.ndarray, "f h w"],
    still: Bool[np.ndarray, "f h w"],
) -> Float[np.ndarray, "h w"]:
    """Inverse depth of a frame's still pixels: the weighted median of its own and of its neighbours' maps.

    A map counts by the inverse of its variance. A car is put on the road far better from nearby than from
    afar, so that the frames that come close to it decide.
    """
    frames, cameras = view.frames, view.cameras
    at = frames.index(frame)
    others = [frames[at + step] for step in _STEPS if 0 <= at + step < len(frames)]
    shift = [np.zeros(inverse.shape[1:], np.float32)]
    weight = [np.where(inverse[frame] > 0, 1 / np.maximum(spread[frame], _LEAST_SPREAD) ** 2, 0)]
    for other in others:
        warp = Warp(cameras[frame], cameras[other])
        x, y = warp(inverse[frame])
        found, trust = (cv2.remap(maps[other], x, y, cv2.INTER_NEAREST) for maps in (inverse, spread))
        stays = cv2.remap(still[other].astype(np.uint8), x, y, cv2.INTER_NEAREST) > 0
        ahead = warp.rotated[2] + np.float32(warp.translation[2]) * inverse[frame]
        expected = inverse[frame] / np.maximum(ahead, 1e-3)
        both = (found > 0) & (expected > 0) & stays & (ahead > 0.05)
        # Log depth that the neighbour would give, against the frame's own.
        off = np.log(np.where(both, expected, 1) / np.where(both, found, 1)).astype(np.float32)
        both &= np.abs(off) < _ALIKE
        shift.append(np.where(both, off, 0))
        weight.append(np.where(both, 1 / np.maximum(trust, _LEAST_SPREAD) ** 2, 0))
    change = weighted_median(np.stack(shift), np.stack(weight))
    moved = still[frame] & (inverse[frame] > 0)
    return np.where(moved, inverse[frame] * np.exp(-change), inverse[frame]).astype(np.float32)
