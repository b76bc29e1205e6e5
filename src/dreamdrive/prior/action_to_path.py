"""From an action back to the path that it asks for, with the conventions of ``path_to_action``."""

import numpy as np
from jaxtyping import Float
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator
from scipy.spatial.transform import Rotation

from dreamdrive.prior.path_to_action import turn_of
from dreamdrive.scene.action import AT_S, Steering, Waypoints
from dreamdrive.scene.trajectory import Trajectory

_STEPS_A_SECOND = 200
_STANDING_M_S = 0.05


def path_of(action: Waypoints | Steering, times_s: Float[np.ndarray, " t"]) -> Trajectory:
    """The path of the camera at increasing times, the first of them 0, on a level road.

    Waypoints are joined by cubic pieces that do not overshoot (Fritsch and Carlson 1980), from a start
    straight ahead, and the camera looks along the path. Speed and turn run the same way between their four
    values; the first of them holds before it. What was asked for last goes on: the velocity of waypoints,
    speed and turn of steering.
    """
    if times_s[0] != 0:
        raise ValueError(f"a path starts at time 0, not {times_s[0]:g}")
    poses = _through(action, times_s) if isinstance(action, Waypoints) else _steered(action, times_s)
    return Trajectory(poses, times_s)


def _through(action: Waypoints, times_s: np.ndarray) -> Float[np.ndarray, "t 4 4"]:
    knots = np.array([0.0, *AT_S])
    # Rounded: slopes are divided by, and those of the smallest numbers overflow.
    places = np.round([(0.0, 0.0), *zip(action.right_m, action.ahead_m, strict=True)], 12)
    slopes = PchipInterpolator(knots, places)(knots, 1)
    slopes[0, 0] = 0.0
    curve = CubicHermiteSpline(knots, places, slopes)
    inside = np.minimum(times_s, AT_S[-1])
    velocity = curve(inside, 1)
    at = curve(inside) + velocity * (times_s - inside)[:, None]
    return _poses(at, _along(velocity))


def _along(velocity_m_s: Float[np.ndarray, "t 2"]) -> Float[np.ndarray, " t"]:
    """Headings to the left of velocities (right, ahead); where a car stands, the one before holds."""
    left_rad = np.arctan2(-velocity_m_s[:, 0], np.maximum(velocity_m_s[:, 1], 0.0))
    moves = np.linalg.norm(velocity_m_s, axis=1) > _STANDING_M_S
    latest = np.maximum.accumulate(np.where(moves, np.arange(len(moves)), -1))
    return np.where(latest >= 0, left_rad[latest], 0.0)


def _steered(action: Steering, times_s: np.ndarray) -> Float[np.ndarray, "t 4 4"]:
    knots = np.array([0.0, *AT_S])
    steered = np.round(np.column_stack([action.speed_m_s, turn_of(np.array(action.wheel_rad))]), 12)
    curve = PchipInterpolator(knots, np.vstack([steered[:1], steered]))
    fine = np.linspace(0.0, times_s[-1], max(2, int(np.ceil(times_s[-1] * _STEPS_A_SECOND)) + 1))
    speed, per_m = curve(np.minimum(fine, AT_S[-1])).T
    left_rad = cumulative_trapezoid(speed * per_m, fine, initial=0)
    velocity = speed[:, None] * np.column_stack([-np.sin(left_rad), np.cos(left_rad)])
    at = cumulative_trapezoid(velocity, fine, axis=0, initial=0)
    right, ahead, left = (np.interp(times_s, fine, values) for values in (*at.T, left_rad))
    return _poses(np.column_stack([right, ahead]), left)


def _poses(at_m: Float[np.ndarray, "t 2"], left_rad: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 4 4"]:
    poses = np.tile(np.eye(4), (len(at_m), 1, 1))
    # y is down, so that a positive turn about it is to the right.
    poses[:, :3, :3] = Rotation.from_rotvec(np.outer(-left_rad, [0, 1, 0])).as_matrix()
    poses[:, 0, 3], poses[:, 2, 3] = at_m.T
    return poses
