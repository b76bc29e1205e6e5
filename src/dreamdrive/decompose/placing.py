"""Where a rigid thing is in each frame that saw it: place, yaw and depth, by all frames at once.

A frame's depth tells how far its points are from each other better than how far they are away. What is
estimated is therefore, for each frame, the place and the yaw of the thing and one factor of the depth that
the frame saw, so that points which optical flow carries from one frame to the next meet there: in the image
as well as in depth. Motion is smooth.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import radians

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.scene.camera import NEAR_M, Camera

_STATE = 5  # of a frame: place along three axes, yaw, logarithm of the factor of depth
_STEPS = 24
_STILL_M = 1e-3  # by which the last step may still move a place
_DIFFERENCE = 1e-4  # that stands for a derivative
_MOST_FACTOR = 0.7  # of the logarithm
_PLACE_M = 0.3  # beside the share of the distance
_FREE = 1e-6


@dataclass(frozen=True)
class PlacingOptions:
    """How much each measurement is trusted: standard deviations.

    Attributes:
        flow_px: Of a point carried by optical flow.
        lost_px: At which flow counts as lost when the estimate begins; in the end it is three times
            ``flow_px``.
        depth: Of the logarithm of the depth at which two frames see one point.
        factor: Of the logarithm of the factor of a frame's depth.
        place: Of the middle of the points of a frame, in shares of their distance: each frame sees another
            part of the thing.
        cut_m: Added to that where the border of the picture cuts the thing off: one end is all that it shows.
            With 0.3, as where it is whole, a van that overtakes on drawn street 3 is 0.24 m off in place of
            0.14, and the view 2 m aside loses 1.7 dB.
        acceleration_m_s2: Of what moves along the road.
        climb_m_s2: Across it.
        yaw_rate_deg_s: Of its yaw.
        yaw_acceleration_deg_s2: Of the change of that.
        samples: Most points that are carried from one frame to the next.
        independent: So many of them count, as neighbours err alike.
    """

    flow_px: float = 0.7
    lost_px: float = 12.0
    depth: float = 0.1
    factor: float = 0.08
    place: float = 0.06
    cut_m: float = 3.0
    acceleration_m_s2: float = 2.5
    climb_m_s2: float = 0.3
    yaw_rate_deg_s: float = 20.0
    yaw_acceleration_deg_s2: float = 40.0
    samples: int = 120
    independent: float = 12.0


@dataclass(frozen=True)
class Glances:
    """The K frames that saw a thing, in order.

    Attributes:
        cameras: Their cameras.
        times_s: Their times.
        middles_m: The middles of what they saw, in the world.
        whole: Which of them saw all of it: the border of the picture cuts it off in the others.
    """

    cameras: Sequence[Camera]
    times_s: Float[np.ndarray, " k"]
    middles_m: Float[np.ndarray, "k 3"]
    whole: Bool[np.ndarray, " k"]


@dataclass(frozen=True)
class Carried:
    """Points that flow carries from one frame of a thing to another.

    Frames are told by their index among those that saw the thing. Each of the N points has its place and its
    depth in the first picture and in the second.
    """

    first: int
    second: int
    first_px: Float[np.ndarray, "n 2"]
    first_m: Float[np.ndarray, " n"]
    second_px: Float[np.ndarray, "n 2"]
    second_m: Float[np.ndarray, " n"]


@dataclass(frozen=True)
class Placement:
    """A rigid thing in each of K frames.

    Attributes:
        place_m: Of one point of it, in the world.
        yaw_rad: Turn about the up axis, right-handed, against a frame about the middle.
        factor: Of the depth that each frame saw.
        spread_m: Standard deviation of the place along the axis in which it is known least.
    """

    place_m: Float[np.ndarray, "k 3"]
    yaw_rad: Float[np.ndarray, " k"]
    factor: Float[np.ndarray, " k"]
    spread_m: Float[np.ndarray, " k"]


def placed(
    seen: Glances, carried: Sequence[Carried], up: Float[np.ndarray, "3"], options: PlacingOptions
) -> Placement:
    """The motion that explains most; ``up`` is the axis of yaw."""
    count = len(seen.cameras)
    flow = _Flow(seen.cameras, carried, up, options) if carried else None
    prior = _prior(seen, up, options)
    state = np.zeros((count, _STATE))
    state[:, :3] = seen.middles_m
    normal = np.eye(state.size)
    for step in range(_STEPS):
        normal, gradient = prior.terms(state)
        # The first step has none: from far away the wrong points would pass for lost.
        if step and flow is not None:
            narrowed = max(0.0, 1 - step / (0.6 * _STEPS))
            more, pull = flow.terms(state, 3 * options.flow_px + narrowed * options.lost_px)
            normal, gradient = normal + more, gradient + pull
        change = np.linalg.solve(normal, -gradient).reshape(count, _STATE)
        state = state + change
        state[:, 4] = state[:, 4].clip(-_MOST_FACTOR, _MOST_FACTOR)
        if step > 0.7 * _STEPS and np.abs(change[:, :3]).max() < _STILL_M:
            break
    spread_m = _spread_m(np.linalg.inv(normal), count)
    return Placement(state[:, :3], state[:, 3] - state[count // 2, 3], np.exp(state[:, 4]), spread_m)


def _spread_m(covariance: Float[np.ndarray, "m m"], count: int) -> Float[np.ndarray, " k"]:
    """Of each place, the deviation along the axis in which it is known least."""
    blocks = covariance.reshape(count, _STATE, count, _STATE)[np.arange(count), :3, np.arange(count), :3]
    return np.sqrt(np.linalg.eigvalsh(blocks)[:, -1].clip(0))


class _Flow:
    """What carried points say."""

    def __init__(
        self,
        cameras: Sequence[Camera],
        carried: Sequence[Carried],
        up: Float[np.ndarray, "3"],
        options: PlacingOptions,
    ) -> None:
        self._up, self._options = up, options
        sizes = [len(each.first_m) for each in carried]
        self._pairs = [(each.first, each.second) for each in carried]
        self._starts = np.cumsum([0, *sizes[:-1]])
        self._first, self._second = (np.repeat(each, sizes) for each in zip(*self._pairs, strict=True))
        self._share = np.repeat([options.independent / size for size in sizes], sizes)[:, None]
        poses = np.stack([camera.world_from_camera for camera in cameras])
        self._centre = poses[self._first, :3, 3]
        seen = [cameras[each.first].lift(np.column_stack([each.first_px, each.first_m])) for each in carried]
        self._arm = np.concatenate(seen) - self._centre
        self._other = np.linalg.inv(poses)[self._second]
        lens = np.array([[c.fx_px, c.fy_px, c.cx_px, c.cy_px] for c in cameras])[self._second]
        self._focal, self._middle = lens[:, :2], lens[:, 2:]
        self._target = np.concatenate([each.second_px for each in carried])
        self._log_depth = np.log(np.concatenate([each.second_m for each in carried]))

    def _off(
        self, one: Float[np.ndarray, "n 5"], other: Float[np.ndarray, "n 5"]
    ) -> Float[np.ndarray, "n 3"]:
        """By how much each point misses, in pixels and in log depth, by the state of both its frames."""
        seen = self._centre + np.exp(one[:, 4:]) * self._arm
        there = _about(self._up, seen - one[:, :3], other[:, 3] - one[:, 3]) + other[:, :3]
        local = np.einsum("nij,nj->ni", self._other[:, :3, :3], there) + self._other[:, :3, 3]
        z = np.maximum(local[:, 2:], NEAR_M)
        missed = self._focal * local[:, :2] / z + self._middle - self._target
        return np.column_stack([missed, np.log(z[:, 0]) - other[:, 4] - self._log_depth])

    def terms(
        self, state: Float[np.ndarray, "k 5"], lost_px: float
    ) -> tuple[Float[np.ndarray, "m m"], Float[np.ndarray, " m"]]:
        """Normal matrix and gradient of the robust squares."""
        one, other = state[self._first], state[self._second]
        off = self._off(one, other)
        slopes = np.empty((*off.shape, 2 * _STATE))
        for k, step in enumerate(_DIFFERENCE * np.eye(_STATE)):
            slopes[..., k] = (self._off(one + step, other) - off) / _DIFFERENCE
            slopes[..., _STATE + k] = (self._off(one, other + step) - off) / _DIFFERENCE
        weight = np.empty_like(off)
        weight[:, :2] = _trust(np.hypot(off[:, 0], off[:, 1]) / lost_px)[:, None] / self._options.flow_px**2
        weight[:, 2] = _trust(off[:, 2] / self._options.depth / 3) / self._options.depth**2
        weighted = slopes * (weight * self._share)[..., None]
        blocks = np.add.reduceat(np.einsum("nri,nrj->nij", weighted, slopes), self._starts)
        pulls = np.add.reduceat(np.einsum("nri,nr->ni", weighted, off), self._starts)
        normal, gradient = np.zeros((state.size, state.size)), np.zeros(state.size)
        for pair, block, pull in zip(self._pairs, blocks, pulls, strict=True):
            rows = np.concatenate([_STATE * frame + np.arange(_STATE) for frame in pair])
            normal[np.ix_(rows, rows)] += block
            gradient[rows] += pull
        return normal, gradient


@dataclass(frozen=True)
class _Prior:
    """Linear equations of the state; the first, by threes, are of the places, which may be wrong."""

    rows: Float[np.ndarray, "r m"]
    wanted: Float[np.ndarray, " r"]

    def terms(
        self, state: Float[np.ndarray, "k 5"]
    ) -> tuple[Float[np.ndarray, "m m"], Float[np.ndarray, " m"]]:
        """Normal matrix and gradient."""
        off = self.rows @ state.ravel() - self.wanted
        weight, places = np.ones(len(off)), 3 * len(state)
        weight[:places] = np.repeat(_trust(np.linalg.norm(off[:places].reshape(-1, 3), axis=1) / 3), 3)
        weighted = self.rows.T * weight
        # Nothing tells the yaw that all frames share.
        return weighted @ self.rows + _FREE * np.eye(state.size), weighted @ off


def _prior(seen: Glances, up: Float[np.ndarray, "3"], options: PlacingOptions) -> _Prior:
    """What is known without flow: about the places, and that motion is smooth."""
    count = len(seen.cameras)
    arm = seen.middles_m - np.stack([camera.world_from_camera[:3, 3] for camera in seen.cameras])
    off = options.place * np.linalg.norm(arm, axis=1) + np.where(seen.whole, _PLACE_M, options.cut_m)
    place, factor = np.zeros((count, 3, count, _STATE)), np.zeros((count, count, _STATE))
    for k in range(count):
        place[k, :, k, :3] = np.eye(3) / off[k]
        place[k, :, k, 4] = -arm[k] / off[k]
        factor[k, k, 4] = 1 / options.factor
    gaps_s = np.diff(seen.times_s)
    turn = np.zeros((count - 1, count, _STATE))
    for k, gap_s in enumerate(gaps_s):
        turn[k, k : k + 2, 3] = np.array([-1, 1]) / gap_s / radians(options.yaw_rate_deg_s)
    across = np.outer(up, up)
    hard = (np.eye(3) - across) / options.acceleration_m_s2 + across / options.climb_m_s2
    bend, twist = (
        np.zeros((max(count - 2, 0), 3, count, _STATE)),
        np.zeros((max(count - 2, 0), count, _STATE)),
    )
    for k, (before_s, after_s) in enumerate(pairwise(gaps_s)):
        second = np.array([1 / before_s, -1 / before_s - 1 / after_s, 1 / after_s]) * 2 / (before_s + after_s)
        bend[k, :, k : k + 3, :3] = second[:, None] * hard[:, None]
        twist[k, k : k + 3, 3] = second / radians(options.yaw_acceleration_deg_s2)
    parts = [each.reshape(-1, count * _STATE) for each in (place, factor, turn, bend, twist)]
    rows = np.concatenate(parts)
    wanted = np.zeros(len(rows))
    wanted[: 3 * count] = (seen.middles_m / off[:, None]).ravel()
    return _Prior(rows, wanted)


def _trust(off: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Weights of squares that lose what is far off (Geman and McClure 1985)."""
    return 1 / (1 + off**2) ** 2


def _about(
    axis: Float[np.ndarray, "3"], vectors: Float[np.ndarray, "n 3"], angle_rad: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "n 3"]:
    """Vectors turned about an axis (Rodrigues' formula)."""
    cosine, sine = np.cos(angle_rad)[:, None], np.sin(angle_rad)[:, None]
    along = (vectors @ axis)[:, None] * axis
    return along + (vectors - along) * cosine + np.cross(axis, vectors) * sine
