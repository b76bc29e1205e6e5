"""Motion of the camera or its absence, from sparse optical flow."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.geometry.evidence.features import is_little

WIDTH_PX = 320
WINDOW_S = 0.2
STANDING_PX = 1.0
STANDING_LOWER_PX = 0.3
CORNERS = 400
FORWARD_BACKWARD_PX = 0.7
DARK_LEVEL = 24.0
FEW_TRACKS = 30


@dataclass(frozen=True)
class PictureMotion:
    """How much the picture moves."""

    flow_px: Float[np.ndarray, " s"]  # 70th percentile from each frame to the next, at 320 px width
    moving: Bool[np.ndarray, " s"]  # whether the camera moves in that step
    standing: bool  # in the whole clip
    brightness: float  # median over frames of the 90th percentile of grey levels
    tracks: float  # median number of tracked corners


def track(
    first: UInt8[np.ndarray, "h w"], second: UInt8[np.ndarray, "h w"], usable: Bool[np.ndarray, "h w"]
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2"]]:
    """Corners of ``first`` followed into ``second`` by pyramidal Lucas-Kanade, checked both ways.

    Where little is usable they are weaker, relative to the clearest, and lie closer.
    """
    none = np.zeros((0, 2), np.float32)
    quality, apart_px = (0.001, 3) if is_little(usable) else (0.01, 6)
    mask = usable.astype(np.uint8) * 255
    corners: Any = cv2.goodFeaturesToTrack(first, CORNERS, quality, apart_px, mask=mask)
    if corners is None or len(corners) == 0:
        return none, none
    there, found = _follow(first, second, corners)
    back, found_back = _follow(second, first, there)
    good = (found[:, 0] > 0) & (found_back[:, 0] > 0)
    good &= np.linalg.norm((corners - back)[:, 0], axis=1) < FORWARD_BACKWARD_PX
    return corners[good, 0], there[good, 0]


def _follow(first: np.ndarray, second: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    there, found, _ = cv2.calcOpticalFlowPyrLK(
        first, second, points, np.empty_like(points), winSize=(15, 15), maxLevel=3
    )
    return np.asarray(there), np.asarray(found)


def measure(
    grey: UInt8[np.ndarray, "f h w"], usable: Bool[np.ndarray, "f h w"], times_s: Float[np.ndarray, " f"]
) -> PictureMotion:
    """Motion of a clip; ``grey`` is at 320 px width.

    A step counts as moving when in it, or over two frames and 0.2 s, the 70th percentile of the flow reaches
    one pixel and the 25th a third of one: traffic that passes a standing camera moves only a part of the
    picture. The clip stands when fewer than three windows, or 15 % of them, move.
    """
    count = len(grey)
    interval = float(np.median(np.diff(times_s))) if count > 1 else WINDOW_S
    gap = min(max(2, round(WINDOW_S / max(interval, 1e-6))), max(count - 1, 1))
    windows = [_flow(grey, usable, start, start + gap) for start in range(max(count - gap, 0))]
    steps = [_flow(grey, usable, start, start + 1) for start in range(count - 1)]
    step_moves = np.array([_exceeds(step) for step in steps], dtype=bool)
    window_moves = np.array(
        [_exceeds(seen) or step_moves[start : start + gap].any() for start, seen in enumerate(windows)],
        dtype=bool,
    )
    moving = np.zeros(max(count - 1, 0), bool)
    for step in range(count - 1):
        around = window_moves[max(0, step - gap + 1) : step + 1]
        moving[step] = around.any() and steps[step][0] >= 0.5 * STANDING_PX / gap * 2
    return PictureMotion(
        flow_px=np.array([upper for upper, _, _ in steps]).reshape(-1),
        moving=moving,
        standing=bool(window_moves.sum() < min(3, max(1, len(windows))) or window_moves.mean() < 0.15),
        brightness=float(np.median([np.percentile(frame, 90) for frame in grey])),
        tracks=float(np.median([found for _, _, found in windows])) if windows else 0.0,
    )


def _exceeds(seen: tuple[float, float, int]) -> bool:
    upper, lower, _ = seen
    return upper >= STANDING_PX and lower >= STANDING_LOWER_PX


def _flow(grey: np.ndarray, usable: np.ndarray, first: int, second: int) -> tuple[float, float, int]:
    here, there = track(grey[first], grey[second], usable[first])
    if len(here) < FEW_TRACKS // 3:
        return 0.0, 0.0, len(here)
    length = np.linalg.norm(there - here, axis=1)
    return float(np.percentile(length, 70)), float(np.percentile(length, 25)), len(here)
