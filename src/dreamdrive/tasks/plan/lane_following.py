"""A planner that follows its lane and keeps its distance, by the intelligent driver model."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan.trajectory import STEP_S, STEPS, Plan

_INNER_S = 0.05
"""Longest step of the speed's integration."""


@dataclass(frozen=True)
class IdmOptions:
    """The intelligent driver model of Treiber, Hennecke and Helbing (2000), for calm driving in towns.

    Attributes:
        desired_m_s: Speed on an empty road: 50 km/h.
        headway_s: Time to the car ahead at which one follows.
        least_gap_m: Gap that is left at standstill.
        acceleration_m_s2: Largest acceleration.
        braking_m_s2: Comfortable braking.
        hardest_m_s2: Braking that is never exceeded.
        exponent: How late the acceleration fades on the way to the desired speed.
        settle_m: Way over which the car comes from beside the centre line onto it.
    """

    desired_m_s: float = 13.9
    headway_s: float = 1.5
    least_gap_m: float = 2.0
    acceleration_m_s2: float = 1.5
    braking_m_s2: float = 2.0
    hardest_m_s2: float = 8.0
    exponent: float = 4.0
    settle_m: float = 20.0

    def __post_init__(self) -> None:
        above = self.desired_m_s, self.acceleration_m_s2, self.braking_m_s2, self.hardest_m_s2, self.settle_m
        if not all(0 < value < np.inf for value in (*above, self.exponent)):
            raise InputError(f"{self}; expected speeds, accelerations, exponent and settle_m above 0")
        if not all(0 <= value < np.inf for value in (self.headway_s, self.least_gap_m)):
            raise InputError(f"{self}; expected headway_s and least_gap_m of 0 or more")


@dataclass(frozen=True)
class Lead:
    """The car ahead in the same lane, which keeps its speed.

    Attributes:
        gap_m: Along the lane, from our front to its rear.
        speed_m_s: Along the lane.
    """

    gap_m: float
    speed_m_s: float


IDM = IdmOptions()


def follow_lane(
    centre_line: Float[np.ndarray, "n 2"],
    speed_m_s: float,
    lead: Lead | None = None,
    options: IdmOptions = IDM,
    steps: int = STEPS,
    step_s: float = STEP_S,
) -> Plan:
    """Along the centre line from where the car is, as fast as the intelligent driver model wants.

    Args:
        centre_line: Polyline (N, 2) in the planning frame, in the direction of travel. Behind its end it goes
            straight on. The car, which is at the origin, joins it over ``settle_m``.
        speed_m_s: Of the car now.
        lead: The car ahead; None where there is none.
        options: The model.
        steps: Waypoints of the plan.
        step_s: Time between them.

    Raises:
        InputError: The centre line has fewer than two different points, or a number is not finite.
    """
    line = _cleaned(centre_line)
    if not 0 <= speed_m_s < np.inf or (lead is not None and not math.isfinite(lead.gap_m + lead.speed_m_s)):
        raise InputError(
            f"a speed of {speed_m_s} m/s behind {lead}; expected finite numbers, and a speed of 0 or more"
        )
    ways_m = _ways(speed_m_s, lead, options, steps, step_s)
    stations = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    start_m = _station(line, stations)
    beside = -_at(line, stations, np.array([start_m]))[0]
    left = 1 - np.clip(ways_m / options.settle_m, 0, 1)
    fading = left * left * (3 - 2 * left)
    return Plan(_at(line, stations, start_m + ways_m) + fading[:, None] * beside, step_s)


def _ways(
    speed: float, lead: Lead | None, options: IdmOptions, steps: int, step_s: float
) -> Float[np.ndarray, " t"]:
    """How far the car has come at each waypoint."""
    inner = math.ceil(step_s / _INNER_S)
    span_s = step_s / inner
    gap, way = np.inf if lead is None else lead.gap_m, 0.0
    found = np.empty(steps)
    for count in range(1, steps * inner + 1):
        change = _acceleration(speed, gap, 0.0 if lead is None else speed - lead.speed_m_s, options)
        # It brakes to a stop within the span, and not beyond.
        moving_s = min(span_s, -speed / change) if change < 0 else span_s
        moved = speed * moving_s + change * moving_s**2 / 2
        speed = max(speed + change * span_s, 0.0)
        way += moved
        gap += 0.0 if lead is None else lead.speed_m_s * span_s - moved
        if count % inner == 0:
            found[count // inner - 1] = way
    return found


def _acceleration(speed: float, gap: float, closing: float, options: IdmOptions) -> float:
    free = (speed / options.desired_m_s) ** options.exponent
    comfortable = 2 * math.sqrt(options.acceleration_m_s2 * options.braking_m_s2)
    wanted = options.least_gap_m + max(0.0, speed * options.headway_s + speed * closing / comfortable)
    near = (wanted / gap) ** 2 if gap > 0 else np.inf
    return max(options.acceleration_m_s2 * (1 - free - near), -options.hardest_m_s2)


def _cleaned(centre_line: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "m 2"]:
    """The polyline without points that are the same as the one before."""
    line = centre_line.astype(np.float64)
    if np.isfinite(line).all() and len(line):
        line = line[np.concatenate([[True], np.linalg.norm(np.diff(line, axis=0), axis=1) > 0])]
        if len(line) >= 2:
            return line
    raise InputError(
        f"a centre line of {len(centre_line)} points; expected two or more, different and finite"
    )


def _station(line: Float[np.ndarray, "n 2"], stations: Float[np.ndarray, " n"]) -> float:
    """How far along the line the point lies that is nearest to the origin."""
    sides, lengths = np.diff(line, axis=0), np.diff(stations)
    share = np.clip(-(line[:-1] * sides).sum(axis=1) / lengths**2, 0, 1)
    nearest = np.linalg.norm(line[:-1] + share[:, None] * sides, axis=1).argmin()
    return float(stations[nearest] + share[nearest] * lengths[nearest])


def _at(
    line: Float[np.ndarray, "n 2"], stations: Float[np.ndarray, " n"], wanted: Float[np.ndarray, " t"]
) -> Float[np.ndarray, "t 2"]:
    """Points (T, 2) of the line, which goes straight on behind its end."""
    index = np.clip(np.searchsorted(stations, wanted, side="right") - 1, 0, len(line) - 2)
    share = (wanted - stations[index]) / (stations[index + 1] - stations[index])
    return line[index] + share[:, None] * (line[index + 1] - line[index])
