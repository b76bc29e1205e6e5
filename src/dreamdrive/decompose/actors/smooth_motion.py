"""Priors on a thing's motion: roughly its places, and that it drives."""

from itertools import pairwise
from math import radians

import numpy as np
from jaxtyping import Float

from dreamdrive.decompose.actors.observations import STATE, Observations, PlacingOptions

_PLACE_M = 0.3  # beside the share of the distance
_FREE = 1e-6  # of every unknown, so that there is a solution


class SmoothMotion:
    """Places near what frames saw, smooth motion, and yaw that belongs to the path.

    Behind the states one more unknown tells where the thing points at yaw 0: its angle against the way from
    the first of its places to the last, in radians.
    """

    def __init__(self, seen: Observations, up: Float[np.ndarray, "3"], options: PlacingOptions) -> None:
        self._places, self._wanted = _places(seen, options)
        self._smooth = _smooth(seen.times_s, up, options)
        self._gaps_s, self._slip_m_s = np.diff(seen.times_s)[:, None], options.slip_m_s
        way = seen.middles_m[-1] - seen.middles_m[0]
        ahead = way - (way @ up) * up
        length = float(np.linalg.norm(ahead))
        # Of what seems to stand any direction will do to begin with.
        self._ahead = ahead / length if length > 0 else np.cross(up, [1.0, 0.0, 0.0])
        self._left = np.cross(up, self._ahead)

    def terms(
        self, state: Float[np.ndarray, "k 5"], course_rad: float
    ) -> tuple[Float[np.ndarray, "m m"], Float[np.ndarray, " m"]]:
        """Normal matrix and gradient, the last unknown behind those of the states."""
        away = self._places @ state.ravel() - self._wanted
        # The places of single frames may be wrong.
        weight = np.repeat(trust(np.linalg.norm(away.reshape(-1, 3), axis=1) / 3), 3)[:, None]
        slip, by_slip = self._slip(state, course_rad)
        smooth, weighted = self._smooth, weight * self._places
        normal, gradient = by_slip.T @ by_slip, by_slip.T @ slip
        normal[:-1, :-1] += self._places.T @ weighted + smooth.T @ smooth
        gradient[:-1] += weighted.T @ away + smooth.T @ (smooth @ state.ravel())
        # Nothing tells the yaw that all frames share.
        return normal + _FREE * np.eye(len(normal)), gradient

    def ahead(self, angle_rad: float) -> Float[np.ndarray, "3"]:
        """The direction at an angle against the way from the first place to the last."""
        return np.cos(angle_rad) * self._ahead + np.sin(angle_rad) * self._left

    def _slip(
        self, state: Float[np.ndarray, "k 5"], course_rad: float
    ) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, "s m"]]:
        """Speed across the direction in which it points, from frame to frame, and its derivatives."""
        angle = 0.5 * (state[1:, 3] + state[:-1, 3])[:, None] + course_rad
        across = np.cos(angle) * self._left - np.sin(angle) * self._ahead
        along = np.cos(angle) * self._ahead + np.sin(angle) * self._left
        speed = np.diff(state[:, :3], axis=0) / self._gaps_s / self._slip_m_s
        count = len(speed)
        slopes = np.zeros((count, len(state), STATE))
        moved, turned = across / self._gaps_s / self._slip_m_s, -(speed * along).sum(axis=1)
        for at, way in ((np.arange(count), -1), (np.arange(1, count + 1), 1)):
            slopes[np.arange(count), at, :3] = way * moved
            slopes[np.arange(count), at, 3] = 0.5 * turned
        every = np.column_stack([slopes.reshape(count, state.size), turned])
        return (speed * across).sum(axis=1), every


def _places(
    seen: Observations, options: PlacingOptions
) -> tuple[Float[np.ndarray, "r m"], Float[np.ndarray, " r"]]:
    """Linear equations of the states, by threes: the middle of what a frame saw, moved by its factor."""
    count = len(seen.cameras)
    arm = seen.middles_m - np.stack([camera.world_from_camera[:3, 3] for camera in seen.cameras])
    off = options.place * np.linalg.norm(arm, axis=1) + np.where(seen.whole, _PLACE_M, options.cut_m)
    place = np.zeros((count, 3, count, STATE))
    for k in range(count):
        place[k, :, k, :3] = np.eye(3) / off[k]
        place[k, :, k, 4] = -arm[k] / off[k]
    return place.reshape(3 * count, -1), (seen.middles_m / off[:, None]).ravel()


def _smooth(
    times_s: Float[np.ndarray, " k"], up: Float[np.ndarray, "3"], options: PlacingOptions
) -> Float[np.ndarray, "r m"]:
    """What should be 0 of the states: factors, acceleration, yaw rate and its change."""
    count, gaps_s = len(times_s), np.diff(times_s)
    factor, turn = np.zeros((count, count, STATE)), np.zeros((count - 1, count, STATE))
    factor[np.arange(count), np.arange(count), 4] = 1 / options.factor
    for k, gap_s in enumerate(gaps_s):
        turn[k, k : k + 2, 3] = np.array([-1, 1]) / gap_s / radians(options.yaw_rate_deg_s)
    across = np.outer(up, up)
    hard = (np.eye(3) - across) / options.acceleration_m_s2 + across / options.climb_m_s2
    bends = max(count - 2, 0)
    bend, twist = np.zeros((bends, 3, count, STATE)), np.zeros((bends, count, STATE))
    for k, (before_s, after_s) in enumerate(pairwise(gaps_s)):
        second = np.array([1 / before_s, -1 / before_s - 1 / after_s, 1 / after_s]) * 2 / (before_s + after_s)
        bend[k, :, k : k + 3, :3] = second[:, None] * hard[:, None]
        twist[k, k : k + 3, 3] = second / radians(options.yaw_acceleration_deg_s2)
    return np.concatenate([each.reshape(-1, count * STATE) for each in (factor, turn, bend, twist)])


def trust(off: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Weights of squares that lose what is far off (Geman and McClure 1985)."""
    return 1 / (1 + off**2) ** 2
