"""The contest between "this stands still" and "this moved as the flow says", pixel by pixel.

A vehicle driving parallel to the camera satisfies the epipolar constraint: it merely looks farther away (same
direction) than it is. What gives it away is the road: nothing that stands still lies below it. The inverse
depth that the flow asks for is therefore compared with the road plane's, and both explanations are compared
with the pictures.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.depth import Correlation, PosedFrames, Warp, sample, weighted_median
from dreamdrive.geometry.moving.flow import PairFlow
from dreamdrive.vision.windows import window_px

_PLANE_SHARE = 0.85  # static things are no farther than this share of the plane's inverse depth
_FLOOR_SHARE = 0.8
_MIN_PLANE_INVERSE = 0.004  # 1/m; nearer to the horizon than this the plane says nothing
_KNOWN_TOLERANCE = 0.1  # of a given inverse depth
_MAX_INVERSE = 0.5  # 1/m
_SLACK_PX = 1.5  # what poses and lens may be off
_GAIN_WINDOW_PX = 5
_ERROR_CAP = 30.0  # grey levels
_WINDOW_PX = 7
_FLOW_CORRELATION = 0.7
_LEAD = 0.25
_TEXTURE = 3.0  # grey levels, standard deviation


@dataclass(frozen=True)
class ContestVerdict:
    """Outcome for one frame."""

    excess_px: Float[np.ndarray, "h w"]  # of the flow beyond what any static point could show, or 0
    gain: Float[np.ndarray, "h w"]  # grey levels by which the flow matches better than a static explanation
    off_line: Bool[np.ndarray, "h w"]  # clearly better matched off the epipolar line or its allowed part


def judge(
    view: PosedFrames,
    frame: int,
    flows: Sequence[PairFlow],
    inverse_depth: Float[np.ndarray, "h w"],
    known: bool,
) -> ContestVerdict:
    """Judge one frame against its neighbours by its flows and its static depth in 1/m.

    Depth that is known was given, and so is exact on moving things too.
    """
    shape = inverse_depth.shape
    correlation = Correlation(view.grey[frame], _WINDOW_PX)
    seen = np.zeros(shape, np.int32)
    wins = np.zeros(shape, np.int32)
    gain = np.zeros(shape, np.float32)
    wanted: list[np.ndarray] = []
    weight: list[np.ndarray] = []
    for flow in flows:
        pair = _Pair(view, frame, flow, inverse_depth, known)
        seen += flow.trusted
        wins += pair.wins(correlation) & flow.trusted
        gain += np.where(flow.trusted, pair.gain(), 0)
        inverse, sensitivity = pair.wanted()
        wanted.append(inverse)
        weight.append(np.where(flow.trusted, sensitivity, 0))
    textured = correlation.variance > _TEXTURE**2
    off_line = textured & (wins >= min(2, len(flows))) & (wins >= 0.4 * seen) & (wins >= 1)
    excess = _excess(view.plane_inverse[frame], inverse_depth, known, wanted, weight)
    return ContestVerdict(excess, gain / np.maximum(seen, 1), off_line)


def _excess(
    plane: Float[np.ndarray, "h w"],
    inverse_depth: Float[np.ndarray, "h w"],
    known: bool,
    wanted: list[np.ndarray],
    weight: list[np.ndarray],
) -> Float[np.ndarray, "h w"]:
    if not wanted:
        return np.zeros(plane.shape, np.float32)
    apparent = weighted_median(np.stack(wanted), np.square(np.stack(weight)))
    px_per_inverse = np.max(weight, axis=0)
    if known:
        beyond = np.abs(apparent - inverse_depth) - _KNOWN_TOLERANCE * inverse_depth
    else:
        beyond = np.where(plane > _MIN_PLANE_INVERSE, _PLANE_SHARE * plane - apparent, 0)
    return np.maximum(beyond * px_per_inverse, 0).astype(np.float32)


class _Pair:
    """One frame and one neighbour: where static points may land, and how each explanation matches."""

    def __init__(
        self,
        view: PosedFrames,
        frame: int,
        flow: PairFlow,
        inverse_depth: Float[np.ndarray, "h w"],
        known: bool,
    ) -> None:
        self.flow = flow
        self.grey = view.grey[flow.source]
        self.reference = view.grey[frame]
        self.warp = Warp(view.cameras[frame], view.cameras[flow.source])
        plane = view.plane_inverse[frame]
        floor = np.float32(_FLOOR_SHARE) * plane
        self.floor = inverse_depth if known else floor
        static = [inverse_depth] if known else [np.maximum(inverse_depth, floor), plane]
        self.known = known
        self.by_flow = sample(self.grey, flow.x, flow.y)
        self.if_static = [sample(self.grey, *self.warp(inverse)) for inverse in static]

    def wanted(self) -> tuple[np.ndarray, np.ndarray]:
        """Inverse depth (1/m) nearest to the flow, unbounded, and pixels of flow per 1/m."""
        camera, (tx, ty, tz) = self.warp.source, self.warp.translation.astype(np.float32)
        u = (self.flow.x - np.float32(camera.cx_px - 0.5)) / np.float32(camera.fx_px)
        v = (self.flow.y - np.float32(camera.cy_px - 0.5)) / np.float32(camera.fy_px)
        rx, ry, rz = self.warp.rotated
        ax, bx = tx - u * tz, u * rz - rx
        ay, by = ty - v * tz, v * rz - ry
        square = ax * ax + ay * ay
        return (ax * bx + ay * by) / np.maximum(square, 1e-9), np.sqrt(square) * np.float32(camera.fx_px)

    def gain(self) -> np.ndarray:
        """Grey levels by which the flow matches better than the best static explanation."""
        return np.min([self._error(each) for each in self.if_static], axis=0) - self._error(self.by_flow)

    def _error(self, picture: np.ndarray) -> np.ndarray:
        difference = np.minimum(np.abs(picture - self.reference), np.float32(_ERROR_CAP))
        side = window_px(_GAIN_WINDOW_PX, picture.shape[1])
        return cv2.boxFilter(difference, cv2.CV_32F, (side, side))

    def wins(self, correlation: Correlation) -> np.ndarray:
        """Flow clearly better correlated than the best static explanation, some slack granted to that one."""
        x, y, residual = self._nearest_allowed()
        explained = [sample(self.grey, x, y), *self.if_static]
        best = np.max([correlation(each) for each in explained], axis=0)
        by_flow = correlation(self.by_flow)
        return (by_flow > _FLOW_CORRELATION) & (by_flow - best > _LEAD) & (residual > _SLACK_PX)

    def _nearest_allowed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Allowed point of the epipolar line nearest to the flow, moved up to the slack towards it."""
        tz = float(self.warp.translation[2])
        nearest = np.full(self.floor.shape, _MAX_INVERSE, np.float32)
        if tz < 0:
            nearest = np.minimum(nearest, (self.warp.rotated[2] - np.float32(0.1)) / np.float32(-tz))
        nearest = self.floor if self.known else np.maximum(nearest, self.floor)
        ax, ay = self.warp(self.floor)
        bx, by = self.warp(nearest)
        dx, dy = bx - ax, by - ay
        share = ((self.flow.x - ax) * dx + (self.flow.y - ay) * dy) / np.maximum(dx * dx + dy * dy, 1e-6)
        share = np.clip(share, 0, 1)
        x, y = ax + share * dx, ay + share * dy
        residual = np.hypot(self.flow.x - x, self.flow.y - y)
        step = np.minimum(1, _SLACK_PX / np.maximum(residual, 1e-6))
        x, y = x + step * (self.flow.x - x), y + step * (self.flow.y - y)
        return x.astype(np.float32), y.astype(np.float32), residual
