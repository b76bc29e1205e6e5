"""What a sensible driver does from the instant of planning on: the true ego."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from dreamdrive.scene.street.layout import Box
from dreamdrive.tasks.plan import CAR, corners
from dreamdrive_bench.planning.ego import EgoWay
from dreamdrive_bench.planning.footprints import FRONT_M, REAR_M, rectangles_of

STEP_S = 0.1
"""Time from one place of the ego to the next."""
_CORRIDOR_M = CAR.width_m / 2 + 0.3
_SIDE_POINTS = 12


@dataclass(frozen=True)
class Covered:
    """What of the ego's way N boxes cover at T times.

    Attributes:
        times_s: The times (T,).
        there: Whether a box covers any of it (T, N).
        low_m: The first station that it covers (T, N).
        high_m: The last one (T, N).
        speed_m_s: How fast it goes along the way, at least 0 (T, N).
    """

    times_s: Float[np.ndarray, " t"]
    there: Bool[np.ndarray, "t n"]
    low_m: Float[np.ndarray, "t n"]
    high_m: Float[np.ndarray, "t n"]
    speed_m_s: Float[np.ndarray, "t n"]


def covered(way: EgoWay, boxes: Sequence[Box], times_s: Float[np.ndarray, " t"]) -> Covered:
    """What boxes cover of the ground that the ego needs on its way, and a little to both sides."""
    stations = way.stations_m
    poses, rectangles = way.poses(stations), rectangles_of(boxes, times_s)
    away, near = KDTree(poses[:, :2]).query(_outlines(rectangles))
    taken = (away < _CORRIDOR_M) & (near > 0) & (near < len(stations) - 1)
    there = np.any(taken, axis=-1)
    low = np.where(taken, stations[near], np.inf).min(axis=-1)
    high = np.where(taken, stations[near], -np.inf).max(axis=-1)
    velocity = np.gradient(rectangles[..., :2], times_s, axis=0)
    yaw = poses[np.where(taken, near, len(stations) - 1).min(axis=-1), 2]
    along = np.cos(yaw) * velocity[..., 0] + np.sin(yaw) * velocity[..., 1]
    return Covered(times_s, there, low, high, np.maximum(along, 0.0))


def _outlines(rectangles: Float[np.ndarray, "t n 5"]) -> Float[np.ndarray, "t n k 2"]:
    """Points along the sides of rectangles, some decimetres apart."""
    corner = corners(rectangles)
    share = np.linspace(0, 1, _SIDE_POINTS, endpoint=False)[:, None]
    sides = [
        corner[..., side, None, :] * (1 - share) + corner[..., (side + 1) % 4, None, :] * share
        for side in range(4)
    ]
    return np.concatenate(sides, axis=-2)


@dataclass(frozen=True)
class Driver:
    """Brakes as the Intelligent Driver Model does, for whom the present speed would bring too near.

    It sees ahead what road users are about to do, and attends to them until they have left its way. Nobody
    makes it brake who is farther away than the gap that it keeps.

    Attributes:
        foresight_s: How far ahead it sees.
        near_m: It attends to whom it would come so near.
        gap_m: That it leaves when it stands.
        headway_s: Time to the car ahead that it keeps.
        gain_m_s2: Acceleration of the model.
        comfort_m_s2: Comfortable braking of the model.
        free_m_s2: With which it comes back to its speed.
        most_braking_m_s2: Braking that it never exceeds.
        most_jerk_m_s3: How fast it changes its mind.
    """

    foresight_s: float = 3.0
    near_m: float = 1.5
    gap_m: float = 2.0
    headway_s: float = 0.8
    gain_m_s2: float = 1.5
    comfort_m_s2: float = 2.5
    free_m_s2: float = 0.8
    most_braking_m_s2: float = 3.5
    most_jerk_m_s3: float = 12.0

    def drive(self, way: EgoWay, covered: Covered) -> Float[np.ndarray, " t"]:
        """Stations (T,) at the times of ``covered``, which are ``STEP_S`` apart and begin at the instant."""
        count, station, speed, change = len(covered.times_s), way.now_m, way.now_m_s, 0.0
        attended = np.zeros(covered.there.shape[1], bool)
        stations = [station]
        for k in range(count - 1):
            ahead = slice(k, min(count, k + round(self.foresight_s / STEP_S) + 1))
            attended |= self._too_near(covered, ahead, station, speed)
            wanted = min(
                self.free_m_s2 * (1 - (speed / way.now_m_s) ** 4),
                self._for_others(covered, ahead, attended, station, speed),
            )
            wanted = max(wanted, -self.most_braking_m_s2)
            most = self.most_jerk_m_s3 * STEP_S
            change = float(np.clip(wanted, change - most, change + most))
            after = max(speed + change * STEP_S, 0.0)
            station, speed = station + (speed + after) / 2 * STEP_S, after
            stations.append(station)
        return np.array(stations)

    def _too_near(
        self, covered: Covered, ahead: slice, station_m: float, speed_m_s: float
    ) -> Bool[np.ndarray, " n"]:
        later = (covered.times_s[ahead] - covered.times_s[ahead.start])[:, None]
        at = station_m + speed_m_s * later
        meets = (at + FRONT_M + self.near_m >= covered.low_m[ahead]) & (
            at + REAR_M - self.near_m <= covered.high_m[ahead]
        )
        return np.any(meets & covered.there[ahead], axis=0)

    def _for_others(
        self,
        covered: Covered,
        ahead: slice,
        attended: Bool[np.ndarray, " n"],
        station_m: float,
        speed_m_s: float,
    ) -> float:
        """Acceleration for whom it attends to, each where it is and where it will be."""
        later = (covered.times_s[ahead] - covered.times_s[ahead.start])[:, None]
        other = covered.speed_m_s[ahead]
        there = covered.there[ahead] & attended & (covered.high_m[ahead] > station_m + REAR_M)
        if not there.any():
            return np.inf
        gap = covered.low_m[ahead] - other * later - station_m - FRONT_M
        closing = speed_m_s * (speed_m_s - other) / (2 * np.sqrt(self.gain_m_s2 * self.comfort_m_s2))
        kept = self.gap_m + np.maximum(0.0, speed_m_s * self.headway_s + closing)
        change = self.gain_m_s2 * (1 - (kept / np.maximum(gap, 0.1)) ** 2)
        return float(change[there].min())
