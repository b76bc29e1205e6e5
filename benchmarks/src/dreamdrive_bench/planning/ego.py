"""The way of the ego: the line that it keeps to, and how it drives until the instant of planning."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from streetworld import Road

_SWAY_M, _SWAY_RAD_S = 0.2, 1.1  # as drawn streets have it
_BEHIND_M, _REACH_M = 5.0, 110.0


@dataclass(frozen=True)
class Swerve:
    """To the left and back again, over stations of the road."""

    left_m: float
    from_m: float
    there_m: float
    back_m: float
    end_m: float

    def at(self, station_m: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """How far to the left (N,)."""
        out = np.clip((station_m - self.from_m) / (self.there_m - self.from_m), 0, 1)
        back = np.clip((station_m - self.back_m) / (self.end_m - self.back_m), 0, 1)
        return self.left_m * (smooth(out) - smooth(back))


def smooth(share: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """From 0 to 1 without a jerk."""
    return share**3 * (10 - 15 * share + 6 * share**2)


@dataclass(frozen=True)
class EgoWay:
    """The line that the front camera follows; stations are those of the road.

    Attributes:
        road: The main road.
        lane_left_m: Where its lane lies.
        start_m: Where it is at time 0.
        speed_m_s: Then.
        change_m_s2: Of the speed, up to the instant.
        instant_s: Of planning.
        phase_rad: Of its sway.
        swerve: Around what sticks out into the lane.
    """

    road: Road
    lane_left_m: float
    start_m: float
    speed_m_s: float
    change_m_s2: float
    instant_s: float
    phase_rad: float
    swerve: Swerve | None = None

    @property
    def stations_m(self) -> Float[np.ndarray, " n"]:
        """Stations (N,) a tenth of a metre apart, as far as it goes."""
        return np.arange(self.start_m, self.start_m + _REACH_M - _BEHIND_M, 0.1)

    @property
    def now_m(self) -> float:
        """Station at the instant."""
        return float(self.before(np.array([self.instant_s]))[0])

    @property
    def now_m_s(self) -> float:
        """Speed at the instant."""
        return self.speed_m_s + self.change_m_s2 * self.instant_s

    def before(self, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, " t"]:
        """Stations (T,) up to the instant."""
        return self.start_m + self.speed_m_s * times_s + 0.5 * self.change_m_s2 * times_s**2

    def steady(self, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, " t"]:
        """Stations (T,) if the ego kept its speed from the instant on."""
        after = self.now_m + self.now_m_s * (times_s - self.instant_s)
        return np.where(times_s <= self.instant_s, self.before(times_s), after)

    def poses(self, station_m: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
        """x, y and yaw (N, 3) of the front camera."""
        velocity = self._line(station_m, 1)
        return np.column_stack([self._line(station_m), np.arctan2(velocity[:, 1], velocity[:, 0])])

    @cached_property
    def _line(self) -> CubicSpline:
        stations = np.arange(self.start_m - _BEHIND_M, self.start_m + _REACH_M)
        turn = _SWAY_RAD_S / self.speed_m_s
        left = self.lane_left_m + _SWAY_M * np.sin(turn * (stations - self.start_m) + self.phase_rad)
        if self.swerve is not None:
            left = left + self.swerve.at(stations)
        return CubicSpline(stations, self.road.at(stations, left)[:, :2])
