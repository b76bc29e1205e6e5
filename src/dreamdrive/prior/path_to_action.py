"""From a wanted path to what video models of the kind of Vista are told.

Paths are those of the camera (x right, y down, z ahead) and count from their first pose and time. The car is
a bicycle (Rajamani, Vehicle Dynamics and Control, 2012, 2.2): its wheels do not slip, so that the camera,
which stands in the middle plane of the car and looks along it, moves ahead as fast as the rear axle does, and
road wheels at the angle a turn it by tan(a) / ``WHEEL_BASE_M`` radians a metre.
"""

from typing import TypeVar

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from dreamdrive.errors import InputError
from dreamdrive.scene.action import AT_S, Command, Four, Goal, Steering, Waypoints, check_action
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.trajectory import Trajectory

WHEEL_BASE_M = 2.588
"""Of the Renault Zoe, the car of nuScenes (the maker's data sheet)."""
STEERING_RATIO = 16.6
"""Angle of the steering wheel over that of the road wheels. The maker publishes none for the Zoe; this is
what users of nuScenes assume, without a source. Cars have 12 to 20: a wheel angle is that uncertain."""
STANDING_M = 1.0
"""A path shorter than this over two seconds is a stop."""
ASIDE_M = 2.0
"""A path that ends this far aside turns, as in ST-P3 and UniAD, which look three seconds ahead, not two."""
CRAWLING_M_S = 0.5
"""Below it a path does not tell where the wheels point: they count as straight."""
Made = TypeVar("Made", Waypoints, Steering)
CAMERA_HEIGHT_M = 1.5
"""Height of a car's camera above the road, unless told."""


def waypoints(path: Trajectory) -> Waypoints:
    """Where the path is at ``AT_S``."""
    _check_length(path)
    places = from_first(path).at(np.array(AT_S))[:, :3, 3]
    return _checked(Waypoints(right_m=_four(places[:, 0]), ahead_m=_four(places[:, 2])))


def steering(path: Trajectory) -> Steering:
    """Speed ahead at ``AT_S``, and the wheel that the bicycle needs for the turn.

    The speed is the slope of a cubic spline through the positions. The turn is that of the heading over the
    distance; what rolls or pitches the camera is no part of it.
    """
    _check_length(path)
    if len(path) < 3:
        raise InputError(f"trajectory: {len(path)} poses do not tell speeds; expected at least 3 within 2 s")
    path = from_first(path)
    poses = path.at(np.array(AT_S))
    velocity = CubicSpline(path.times_s, path.positions_m)(AT_S, 1)
    speed = (velocity * poses[:, :3, 2]).sum(axis=1)
    left_rad = CubicSpline(path.times_s, headings_rad(path.world_from_camera))(AT_S, 1)
    per_m = np.where(speed > CRAWLING_M_S, left_rad / np.maximum(speed, CRAWLING_M_S), 0.0)
    # Poses of a car that stands jitter by less than that.
    speed = np.where((speed < 0) & (speed > -CRAWLING_M_S), 0.0, speed)
    return _checked(Steering(speed_m_s=_four(speed), wheel_rad=_four(wheel_of(per_m))))


def command(path: Trajectory) -> Command:
    """The word for where the path is after two seconds, see ``STANDING_M`` and ``ASIDE_M``."""
    at = waypoints(path)
    right, ahead = at.right_m[-1], at.ahead_m[-1]
    if np.hypot(right, ahead) < STANDING_M:
        return Command("stop")
    if abs(right) < ASIDE_M:
        return Command("forward")
    return Command("right" if right > 0 else "left")


def goal(path: Trajectory, camera: Camera, height_m: float = CAMERA_HEIGHT_M) -> Goal:
    """Where the first frame shows the road under the end of the path; the camera's pose does not count."""
    end = from_first(path).world_from_camera[-1, :3, 3] + np.array([0.0, height_m, 0.0])
    column, row, depth = camera.at(np.eye(4)).project(end[None])[0]
    if depth <= 0:
        raise InputError(
            f"trajectory: its end is {-depth:.3g} m behind the first frame and cannot be its goal"
        )
    shares = column / camera.width_px, row / camera.height_px
    if not all(0 <= share <= 1 for share in shares):
        raise InputError(
            f"trajectory: its end is at {100 * shares[0]:.0f} % of the first frame's width and "
            f"{100 * shares[1]:.0f} % of its height, outside it; choose a path that ends further ahead"
        )
    return Goal(column=float(shares[0]), row=float(shares[1]))


def from_first(path: Trajectory) -> Trajectory:
    """The path in the frame of its first pose, from time 0 on."""
    first = Camera(1, 1, 0, 0, 1, 1, path.world_from_camera[0].astype(np.float64)).camera_from_world
    return Trajectory(first @ path.world_from_camera, path.times_s - path.times_s[0])


def headings_rad(world_from_camera: Float[np.ndarray, "t 4 4"]) -> Float[np.ndarray, " t"]:
    """Directions (T,) of the view from above, without jumps; to the left of the z axis is positive."""
    return np.unwrap(np.arctan2(-world_from_camera[:, 0, 2], world_from_camera[:, 2, 2]))


def wheel_of(left_per_m: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Angles of the steering wheel for turns in radians a metre; to the left is positive."""
    return STEERING_RATIO * np.arctan(WHEEL_BASE_M * left_per_m)


def turn_of(wheel_rad: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """The inverse of ``wheel_of``."""
    return np.tan(wheel_rad / STEERING_RATIO) / WHEEL_BASE_M


def _check_length(path: Trajectory) -> None:
    length_s = float(path.times_s[-1] - path.times_s[0])
    if length_s < AT_S[-1] - 1e-6:
        raise InputError(
            f"trajectory: it lasts {length_s:.3g} s; expected at least the {AT_S[-1]:g} s that are steered by"
        )


def _checked(action: Made) -> Made:
    try:
        check_action(action)
    except InputError as error:
        raise InputError(f"trajectory: no car drives it, {error}") from None
    return action


def _four(values: np.ndarray) -> Four:
    first, second, third, fourth = values.astype(float).tolist()
    return first, second, third, fourth
