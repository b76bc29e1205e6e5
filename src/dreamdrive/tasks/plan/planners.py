"""Planners that all others should beat: they extrapolate how the car drove, and see nothing of the street."""

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan.trajectory import STEP_S, STEPS, Plan, wrapped

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
"""For integrals over [-1, 1]. Paths of three seconds are exact to a micrometre."""


def stand_still(steps: int = STEPS, step_s: float = STEP_S) -> Plan:
    """A car that stays where it is."""
    return Plan(np.zeros((steps, 2)), step_s)


def constant_velocity(
    poses: Float[np.ndarray, "p 3"],
    times_s: Float[np.ndarray, " p"],
    steps: int = STEPS,
    step_s: float = STEP_S,
) -> Plan:
    """Straight on, with the velocity between the last two poses.

    Args:
        poses: x, y, yaw in the planning frame up to now (P, 3), see ``planning_poses``; the last is now.
        times_s: When the car was there, increasing.
        steps: Waypoints of the plan.
        step_s: Time between them.

    Raises:
        InputError: There are fewer than two poses, or times do not increase.
    """
    _check(poses, times_s, 2)
    velocity = (poses[-1, :2] - poses[-2, :2]) / (times_s[-1] - times_s[-2])
    return Plan(poses[-1, :2] + velocity * _times(steps, step_s)[:, None], step_s)


def constant_turn_and_acceleration(
    poses: Float[np.ndarray, "p 3"],
    times_s: Float[np.ndarray, " p"],
    steps: int = STEPS,
    step_s: float = STEP_S,
) -> Plan:
    """On along an arc, with the turn rate and the acceleration between the last three poses.

    A car that brakes stops, and does not drive backwards.

    Args:
        poses: x, y, yaw in the planning frame up to now (P, 3), see ``planning_poses``; the last is now.
        times_s: When the car was there, increasing.
        steps: Waypoints of the plan.
        step_s: Time between them.

    Raises:
        InputError: There are fewer than three poses, or times do not increase.
    """
    _check(poses, times_s, 3)
    spans_s = np.diff(times_s[-3:])
    turns = wrapped(np.diff(poses[-3:, 2]))
    ways = np.diff(poses[-3:, :2], axis=0)
    between = poses[-3:-1, 2] + turns / 2
    # Along the heading halfway, so that a car that drives backwards has a speed below 0. Arcs are longer than
    # the straight way between their ends.
    chords = ways[:, 0] * np.cos(between) + ways[:, 1] * np.sin(between)
    speeds = chords / np.sinc(turns / (2 * np.pi)) / spans_s
    # Speeds are those halfway between poses.
    acceleration = (speeds[1] - speeds[0]) / (spans_s.sum() / 2)
    speed = speeds[1] + acceleration * spans_s[1] / 2
    return Plan(_arc(poses[-1], speed, acceleration, turns[1] / spans_s[1], _times(steps, step_s)), step_s)


def _arc(
    start: Float[np.ndarray, " 3"],
    speed: float,
    acceleration: float,
    turn_rate: float,
    times_s: Float[np.ndarray, " t"],
) -> Float[np.ndarray, "t 2"]:
    """Places (T, 2) of a car that turns and accelerates evenly until it stands."""
    if speed * acceleration < 0:
        times_s = np.minimum(times_s, -speed / acceleration)
    inner = times_s[:, None] / 2 * (1 + _NODES)
    pace = (speed + acceleration * inner) * times_s[:, None] / 2 * _WEIGHTS
    yaw = start[2] + turn_rate * inner
    return start[:2] + np.stack([(pace * np.cos(yaw)).sum(axis=1), (pace * np.sin(yaw)).sum(axis=1)], axis=-1)


def _times(steps: int, step_s: float) -> Float[np.ndarray, " t"]:
    return step_s * np.arange(1, steps + 1)


def _check(poses: Float[np.ndarray, "p 3"], times_s: Float[np.ndarray, " p"], least: int) -> None:
    if len(poses) < least or not np.isfinite(poses).all() or not (np.diff(times_s) > 0).all():
        raise InputError(
            f"{len(poses)} past poses at {times_s.tolist()[-5:]} s; expected {least} or more, finite, at "
            "times that increase"
        )
