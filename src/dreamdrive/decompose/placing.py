"""Where a rigid thing is in each frame that saw it: place, yaw and depth, by all frames at once.

A frame's depth tells how far its points are from each other better than how far they are away. What is
estimated is therefore, for each frame, the place and the yaw of the thing and one factor of the depth that
the frame saw, so that points which optical flow carries from one frame to the next meet there: in the image
as well as in depth. Motion is smooth.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.scene.camera import Camera

_PARAMETERS = 5  # a frame: place along three axes, yaw, logarithm of the factor of depth
_STEPS = 24
_STEP = 1e-4  # of the differences that stand for derivatives


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
        acceleration_m_s2: Of what moves along the road.
        climb_m_s2: Across it.
        yaw_rate_deg_s: Of its yaw.
        yaw_acceleration_deg_s2: Of the change of that.
        samples: Most points that are carried from one frame to the next.
    """

    flow_px: float = 0.7
    lost_px: float = 12.0
    depth: float = 0.1
    factor: float = 0.08
    place: float = 0.06
    acceleration_m_s2: float = 2.5
    climb_m_s2: float = 0.3
    yaw_rate_deg_s: float = 20.0
    yaw_acceleration_deg_s2: float = 40.0
    samples: int = 120


@dataclass(frozen=True)
class Carried:
    """Points that flow carries from one frame of a thing to another: indices of the frames, and of N points
    the place in the first image, their depth there, the place in the second image, and the depth there, not
    a number where unknown.
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
    """

    place_m: Float[np.ndarray, "k 3"]
    yaw_rad: Float[np.ndarray, " k"]
    factor: Float[np.ndarray, " k"]


def placed(
    cameras: Sequence[Camera],
    times_s: Float[np.ndarray, " k"],
    middles_m: Float[np.ndarray, "k 3"],
    carried: Sequence[Carried],
    up: Float[np.ndarray, "3"],
    options: PlacingOptions,
) -> Placement:
    """The motion that explains most.

    ``cameras`` and ``times_s`` are those of the frames that saw the thing, in order, ``middles_m`` the middles
    of what they saw, in the world; ``up`` is the axis of yaw.
    """
    count = len(cameras)
    if count == 1:
        return Placement(middles_m.copy(), np.zeros(1), np.ones(1))
    problem = _Problem(cameras, carried, up)
    prior, wanted = _prior(cameras, times_s, middles_m, up, options)
    state = np.zeros((count, _PARAMETERS))
    state[:, :3] = middles_m
    # Without flow first: from far away robust weights would take the wrong points for lost.
    for step in range(_STEPS):
        lost = options.flow_px * 3 + options.lost_px * max(0.0, 1 - step / (0.6 * _STEPS))
        normal, gradient = _prior_terms(state, prior, wanted)
        if step and len(carried):
            n, g = problem.terms(state, lost, options)
            normal, gradient = normal + n, gradient + g
        normal[np.diag_indices_from(normal)] *= 1.001
        change = np.linalg.solve(normal, -gradient).reshape(count, _PARAMETERS)
        state = state + change
        state[:, 4] = state[:, 4].clip(-0.7, 0.7)
        if step > 0.7 * _STEPS and np.abs(change[:, :3]).max() < 1e-3:
            break
    yaw = state[:, 3] - state[count // 2, 3]
    return Placement(state[:, :3], yaw, np.exp(state[:, 4]))


class _Problem:
    """What carried points say."""

    def __init__(self, cameras: Sequence[Camera], carried: Sequence[Carried], up: np.ndarray) -> None:
        self.up = up
        self.centres = np.stack([camera.world_from_camera[:3, 3] for camera in cameras])
        self.turns = np.stack([camera.world_from_camera[:3, :3] for camera in cameras])
        self.lens = np.array([[c.fx_px, c.fy_px, c.cx_px, c.cy_px] for c in cameras])
        self.pairs = [(each.first, each.second) for each in carried]
        sizes = [len(each.first_m) for each in carried]
        self.starts = np.cumsum([0, *sizes[:-1]]) if sizes else np.zeros(0, int)
        self.first = np.repeat([each.first for each in carried], sizes).astype(int)
        self.second = np.repeat([each.second for each in carried], sizes).astype(int)
        self.share = np.repeat([1 / max(size, 1) for size in sizes], sizes)
        if not carried:
            return
        fx, fy, cx, cy = self.lens[self.first].T
        u, v = np.concatenate([each.first_px for each in carried]).T
        rays = np.stack([(u - cx) / fx, (v - cy) / fy, np.ones_like(u)], axis=1)
        depth = np.concatenate([each.first_m for each in carried])
        self.arm = np.einsum("nij,nj->ni", self.turns[self.first], rays * depth[:, None])
        self.target = np.concatenate([each.second_px for each in carried])
        self.log_depth = np.log(np.concatenate([each.second_m for each in carried]))

    def residuals(self, one: Float[np.ndarray, "n 5"], other: Float[np.ndarray, "n 5"]) -> np.ndarray:
        """Of each point two in pixels and one of log depth, by the state of its first and second frame."""
        seen = self.centres[self.first] + np.exp(one[:, 4:]) * self.arm
        body = _about(self.up, seen - one[:, :3], other[:, 3] - one[:, 3])
        there = body + other[:, :3] - self.centres[self.second]
        local = np.einsum("nji,nj->ni", self.turns[self.second], there)
        z = np.maximum(local[:, 2], 0.1)
        fx, fy, cx, cy = self.lens[self.second].T
        u, v = fx * local[:, 0] / z + cx, fy * local[:, 1] / z + cy
        return np.stack(
            [u - self.target[:, 0], v - self.target[:, 1], np.log(z) - other[:, 4] - self.log_depth], axis=1
        )

    def terms(
        self, state: Float[np.ndarray, "k 5"], lost_px: float, options: PlacingOptions
    ) -> tuple[np.ndarray, np.ndarray]:
        """Normal matrix and gradient of the robust squares."""
        one, other = state[self.first], state[self.second]
        here = self.residuals(one, other)
        slopes = np.empty((len(here), 3, 2 * _PARAMETERS))
        for k in range(_PARAMETERS):
            step = np.zeros(_PARAMETERS)
            step[k] = _STEP
            slopes[..., k] = (self.residuals(one + step, other) - here) / _STEP
            slopes[..., _PARAMETERS + k] = (self.residuals(one, other + step) - here) / _STEP
        unsure = ~np.isfinite(here[:, 2])
        here[unsure, 2] = 0.0
        off = np.hypot(here[:, 0], here[:, 1])
        weight = np.empty_like(here)
        weight[:, :2] = (1 / (1 + (off / lost_px) ** 2) ** 2 / options.flow_px**2)[:, None]
        far = here[:, 2] / options.depth
        weight[:, 2] = np.where(unsure, 0.0, 1 / (1 + (far / 3) ** 2) ** 2 / options.depth**2)
        # Neighbouring points err alike: those of one pair of frames together count as a few.
        weight *= (_INDEPENDENT * self.share)[:, None]
        slopes[unsure, 2] = 0.0
        weighted = slopes * weight[..., None]
        blocks = np.add.reduceat(np.einsum("nri,nrj->nij", weighted, slopes), self.starts)
        pulls = np.add.reduceat(np.einsum("nri,nr->ni", weighted, here), self.starts)
        count = len(state)
        normal, gradient = np.zeros((count * _PARAMETERS,) * 2), np.zeros(count * _PARAMETERS)
        for (a, b), block, pull in zip(self.pairs, blocks, pulls, strict=True):
            rows = np.concatenate([_PARAMETERS * a + np.arange(5), _PARAMETERS * b + np.arange(5)])
            normal[np.ix_(rows, rows)] += block
            gradient[rows] += pull
        return normal, gradient


_INDEPENDENT = 12.0  # points of a pair of frames, as far as their errors go


def _prior(
    cameras: Sequence[Camera],
    times_s: Float[np.ndarray, " k"],
    middles_m: Float[np.ndarray, "k 3"],
    up: Float[np.ndarray, "3"],
    options: PlacingOptions,
) -> tuple[list[tuple[int, Float[np.ndarray, "r n"]]], list[Float[np.ndarray, " r"]]]:
    """Linear equations, of so many rows each that are robust together, and what they shall give."""
    count = len(times_s)
    rows: list[tuple[int, np.ndarray]] = []
    wanted: list[np.ndarray] = []

    def add(row: Float[np.ndarray, "r n"], value: Float[np.ndarray, " r"], *, robust: bool = False) -> None:
        rows.append((int(robust), row.reshape(len(value), -1)))
        wanted.append(value)

    level = np.eye(3) - np.outer(up, up)
    for k, (camera, middle) in enumerate(zip(cameras, middles_m, strict=True)):
        arm = middle - camera.world_from_camera[:3, 3]
        off = options.place * float(np.linalg.norm(arm)) + 0.3
        place = np.zeros((3, count, _PARAMETERS))
        place[:, k, :3] = np.eye(3) / off
        place[:, k, 4] = -arm / off
        add(place, middle / off, robust=True)
        factor = np.zeros((1, count, _PARAMETERS))
        factor[0, k, 4] = 1 / options.factor
        add(factor, np.zeros(1))
    for k in range(count - 1):
        turn = np.zeros((1, count, _PARAMETERS))
        seconds = float(times_s[k + 1] - times_s[k])
        turn[0, k, 3], turn[0, k + 1, 3] = -1, 1
        add(turn / (radians(options.yaw_rate_deg_s) * seconds), np.zeros(1))
    for k in range(1, count - 1):
        before, after = times_s[k] - times_s[k - 1], times_s[k + 1] - times_s[k]
        second = 2 * np.array([1 / before, -1 / before - 1 / after, 1 / after]) / (before + after)
        bend = np.zeros((4, count, _PARAMETERS))
        for at, weight in zip((k - 1, k, k + 1), second, strict=True):
            bend[:3, at, :3] = weight * (
                level / options.acceleration_m_s2 + np.outer(up, up) / options.climb_m_s2
            )
            bend[3, at, 3] = weight / radians(options.yaw_acceleration_deg_s2)
        add(bend, np.zeros(4))
    return rows, wanted


def _prior_terms(
    state: Float[np.ndarray, "k 5"],
    rows: list[tuple[int, Float[np.ndarray, "r n"]]],
    wanted: list[Float[np.ndarray, " r"]],
) -> tuple[np.ndarray, np.ndarray]:
    flat = state.ravel()
    normal, gradient = np.zeros((flat.size, flat.size)), np.zeros(flat.size)
    for (robust, row), value in zip(rows, wanted, strict=True):
        off = row @ flat - value
        weight = 1 / (1 + float(off @ off) / 9) ** 2 if robust else 1.0
        normal += weight * row.T @ row
        gradient += weight * row.T @ off
    normal[np.diag_indices_from(normal)] += 1e-6
    return normal, gradient


def _about(
    axis: Float[np.ndarray, "3"], vectors: Float[np.ndarray, "n 3"], angle_rad: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "n 3"]:
    """Rodrigues' formula."""
    cosine, sine = np.cos(angle_rad)[:, None], np.sin(angle_rad)[:, None]
    along = (vectors @ axis)[:, None] * axis
    return along + (vectors - along) * cosine + np.cross(axis, vectors) * sine
