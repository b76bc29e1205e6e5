"""Other road users in a closed loop: as recorded, or along their recorded paths at another pace."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.tasks.environment.road_users import RoadUsers, RoadUserStates
from dreamdrive.tasks.plan import overlapping

_MOST = 1e4
_PROBE_M = 1.0
"""Steps along its path at which a road user looks for what is in the way."""
_SLOW_M_S = 0.1
"""Below it a road user stands, as recorded: it goes on when the recorded one did."""
_MOVES_M = 2.0
"""A road user that never came so far does not react."""
_HARDEST_M_S2 = 8.0
_EXPONENT = 4.0


@dataclass(frozen=True)
class TrafficOptions:
    """How road users react: by the improved Intelligent Driver Model (Treiber and Kesting), to what is ahead.

    The speed that they want is the recorded one.

    Attributes:
        gap_m: What is kept to a standing thing ahead.
        headway_s: Time behind a moving one.
        accelerate_m_s2: How they pick up speed.
        brake_m_s2: How they like to brake.
        look_m: How far they look along their path.
    """

    gap_m: float = 2.0
    headway_s: float = 1.2
    accelerate_m_s2: float = 1.5
    brake_m_s2: float = 2.0
    look_m: float = 40.0

    def __post_init__(self) -> None:
        if not all(0 < each <= _MOST for each in vars(self).values()):
            raise InputError(f"{self}; expected numbers above 0, at most {_MOST:g}")


class Traffic:
    """Road users over an episode. Each has a clock, and is where it was recorded to be at its clock's time.

    Without options all clocks run as time does. With them a road user that would come too near to something
    ahead goes slower, and its clock with it; nobody catches up. People on foot do as recorded.
    """

    def __init__(self, road_users: RoadUsers, options: TrafficOptions | None) -> None:
        self._road_users, self._options = road_users, options
        self._reacts = np.array([kind != "person" for kind in road_users.kinds], dtype=bool)
        self._reacts &= np.ptp(road_users.table[..., 3], axis=0) > _MOVES_M
        self.start(float(road_users.times_s[0]))

    def start(self, time_s: float) -> None:
        """All as recorded at a time."""
        self._time_s = time_s
        self._late_s, self._pace = np.zeros(len(self._road_users)), np.ones(len(self._road_users))
        self._states = self._road_users.states(self.clocks_s)

    @property
    def clocks_s(self) -> Float[np.ndarray, " n"]:
        """Times (N,) of the recording that the road users are at."""
        return self._time_s - self._late_s

    @property
    def states(self) -> RoadUserStates:
        """Where they are, and how fast."""
        now = self._states
        return RoadUserStates(now.boxes, self._pace * now.speeds_m_s, now.ways_m, now.there)

    def step(self, time_s: float, ego: Float[np.ndarray, "5"], ego_speed_m_s: float) -> None:
        """Let time pass until a later one.

        Args:
            time_s: Until when.
            ego: Rectangle of the own car before the step.
            ego_speed_m_s: Its speed.
        """
        step_s = time_s - self._time_s
        if self._options is not None:
            self._pace = self._reacted(step_s, ego, ego_speed_m_s, self._options)
            self._late_s += (1.0 - self._pace) * step_s
        self._time_s = time_s
        self._states = self._road_users.states(self.clocks_s)

    def _reacted(
        self, step_s: float, ego: Float[np.ndarray, "5"], ego_speed_m_s: float, options: TrafficOptions
    ) -> Float[np.ndarray, " n"]:
        """The pace of each: its speed over the recorded one."""
        now, wanted = self.states, self._states.speeds_m_s
        fast = np.append(now.speeds_m_s, ego_speed_m_s)
        pace = np.ones(len(self._road_users))
        for row in np.flatnonzero(self._reacts & now.there & (wanted > _SLOW_M_S)).tolist():
            gap_m, leader, along = self._leader(row, now, ego, options.look_m)
            speed = float(now.speeds_m_s[row])
            change = _acceleration(speed, float(wanted[row]), gap_m, along * fast[leader], options) * step_s
            pace[row] = min(max((speed + change) / wanted[row], 0.0), 1.0)
        return pace

    def _leader(
        self, row: int, now: RoadUserStates, ego: Float[np.ndarray, "5"], look_m: float
    ) -> tuple[float, int, float]:
        """The free way along the path of a road user, what ends it, and the cosine between their headings.

        What was as near when the user was recorded at that place is no reason to brake: it coped.
        """
        clock_s = float(self.clocks_s[row])
        then = self._road_users.states(np.full(len(self._road_users), clock_s))
        boxes = np.stack(
            [np.vstack([now.boxes, ego]), np.vstack([then.boxes, self._road_users.ego_at(clock_s)])], axis=1
        )
        there = np.stack([np.append(now.there, True), np.append(then.there, True)], axis=1)
        there[row] = False
        own = now.boxes[row]
        reach_m = look_m + 0.5 * (own[2] + boxes[:, 0, 2])
        near = np.flatnonzero(there[:, 0] & (np.hypot(*(boxes[:, 0, :2] - own[:2]).T) < reach_m))
        swept = self._road_users.swept(row, now.ways_m[row] + np.arange(0.0, look_m, _PROBE_M))
        hits = overlapping(swept[:, None, None], boxes[near][None]) & there[near][None]
        first = np.where(hits.any(axis=0), hits.argmax(axis=0), len(swept) + 1)
        nearer = np.where(first[:, 0] < first[:, 1] - 1, first[:, 0], len(swept))
        if not len(near) or nearer.min() == len(swept):
            return math.inf, 0, 1.0
        step, leader = int(nearer.min()), int(near[nearer.argmin()])
        along = math.cos(float(boxes[leader, 0, 4] - swept[step, 4]))
        return max(step - 1, 0) * _PROBE_M, leader, along


def _acceleration(
    speed_m_s: float, wanted_m_s: float, gap_m: float, leader_m_s: float, options: TrafficOptions
) -> float:
    """Of a road user up to its wanted speed: what is farther than the wanted gap changes little."""
    most, brake = options.accelerate_m_s2, options.brake_m_s2
    free = most * (1 - (speed_m_s / wanted_m_s) ** _EXPONENT)
    closing = speed_m_s * (speed_m_s - leader_m_s) / (2 * math.sqrt(most * brake))
    wanted_m = options.gap_m + max(0.0, speed_m_s * options.headway_s + closing)
    ratio = wanted_m / max(gap_m, 0.1)
    if ratio < 1:
        return free * (1 - ratio ** (2 * most / free)) if free > 0 else 0.0
    return max(most * (1 - ratio**2), -_HARDEST_M_S2)
