"""Paths as actions of Vista, and the path that an action means.

Paths are those of the camera (x right, y down, z ahead) and count from their first pose and time. The car is
a bicycle (Rajamani, Vehicle Dynamics and Control, 2012, 2.2): its wheels do not slip, so that the camera,
which stands in the middle plane of the car and looks along it, moves ahead as fast as the rear axle does, and
road wheels at the angle a turn it by tan(a) / ``WHEEL_BASE_M`` radians a metre.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import cast

import numpy as np
from jaxtyping import Float
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator
from scipy.spatial.transform import Rotation

from dreamdrive.data import read_trajectory
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.control import AT_S, Control, Four, Steering, Waypoints, check_action
from dreamdrive.scene.trajectory import Trajectory

WHEEL_BASE_M = 2.588
"""Of the Renault Zoe, the car of nuScenes (the maker's data sheet)."""
STEERING_RATIO = 16.6
"""Angle of the steering wheel over that of the road wheels. The maker publishes none for the Zoe; this is
what users of nuScenes assume, without a source. Cars have 12 to 20: a wheel angle is that uncertain."""
_KNOTS_S = np.array([0.0, *AT_S])
_STEPS_A_SECOND = 200
_STANDING_M_S = 0.05


def from_first(path: Trajectory) -> Trajectory:
    """The path in the frame of its first pose, from time 0 on."""
    first = Camera(1, 1, 0, 0, 1, 1, path.world_from_camera[0].astype(np.float64)).camera_from_world
    return Trajectory(first @ path.world_from_camera, path.times_s - path.times_s[0])


def wanted_path(control: Control) -> Trajectory | None:
    """The path that is asked for, from its file where it is in one; None where none is."""
    asked = control.trajectory
    return read_trajectory(asked) if isinstance(asked, Path) else asked


def asked_path(path: Trajectory, times_s: Float[np.ndarray, " f"]) -> Trajectory:
    """The path at times of frames since the first that is made, from the first of these frames on."""
    return from_first(Trajectory(from_first(path).at(times_s), times_s))


def waypoints_by_round(path: Trajectory, starts_s: Float[np.ndarray, " r"], last_s: float) -> list[Waypoints]:
    """The waypoints of rounds that start at ``starts_s``, each from where the path is then.

    The path has to last until ``last_s``, the time of the last frame, and for all waypoints.
    """
    path = from_first(path)
    needed_s = max(last_s, float(starts_s[-1]) + AT_S[-1])
    if path.times_s[-1] < needed_s - 1e-6:
        raise InputError(
            f"trajectory: it lasts {path.times_s[-1]:.3g} s; expected at least {needed_s:.3g} s for these "
            "frames: give a longer path or fewer --frames"
        )
    return [_waypoints(Trajectory(path.at(start + _KNOTS_S), _KNOTS_S)) for start in starts_s]


def _waypoints(path: Trajectory) -> Waypoints:
    """Of a path at ``_KNOTS_S``."""
    right, _, ahead = from_first(path).positions_m[1:].T.tolist()
    action = Waypoints(right_m=cast(Four, tuple(right)), ahead_m=cast(Four, tuple(ahead)))
    try:
        check_action(action)
    except InputError as error:
        raise InputError(f"trajectory: no car drives it, {error}") from None
    return action


def path_by_rounds(action: Waypoints | Steering, spans: Sequence[range], rate_hz: float) -> Trajectory:
    """The path of all frames that are made where every round is told the same action.

    The action counts from the first frame of the round, of which ``spans`` are the frames.
    """
    round_ = path_of(action, np.arange(len(spans[0])) / rate_hz).world_from_camera
    poses = round_
    for span in spans[1:]:
        poses = np.concatenate([poses[: span.start], poses[span.start] @ round_])
    return Trajectory(poses, np.arange(len(poses)) / rate_hz)


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
    # Rounded: slopes are divided by, and those of the smallest numbers overflow.
    places = np.round([(0.0, 0.0), *zip(action.right_m, action.ahead_m, strict=True)], 12)
    slopes = PchipInterpolator(_KNOTS_S, places)(_KNOTS_S, 1)
    slopes[0, 0] = 0.0
    curve = CubicHermiteSpline(_KNOTS_S, places, slopes)
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
    left_per_m = np.tan(np.array(action.wheel_rad) / STEERING_RATIO) / WHEEL_BASE_M
    steered = np.round(np.column_stack([action.speed_m_s, left_per_m]), 12)
    curve = PchipInterpolator(_KNOTS_S, np.vstack([steered[:1], steered]))
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
