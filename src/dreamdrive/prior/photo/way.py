"""The path into a photo: the one that was asked for, or straight ahead as far as the road is free."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.prior.path import asked_path, path_of, wanted_path
from dreamdrive.prior.photo.street import PhotoStreet
from dreamdrive.scene.control import AT_S, Action, Command, Control, Four, Goal, Steering, Waypoints
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.street.street_class import FLAT
from dreamdrive.scene.trajectory import Trajectory

DRIVEN_M_S = 6.0
"""Where nothing is asked for and nothing is in the way."""
_HALF_WIDTH_M, _KEEP_M = 1.2, 4.0
"""Of the own car's way, and how far it stays from what is in it."""
_TURN_RAD = 3.0
"""Angle of the steering wheel in a turn."""
_SLOWER_M_S = 5.0
_LOW_M, _HIGH_M = 0.3, 2.5
_LEAST_PX = 20


def path_for(
    control: Control, street: PhotoStreet, times_s: Float[np.ndarray, " f"], gone: Sequence[int] = ()
) -> Trajectory:
    """The camera's path from its place in the photo on, at the times of the frames since then.

    Road users that are ``gone``, see ``free_m``, make way.
    """
    path = wanted_path(control)
    if path is not None:
        needed_s = float(path.times_s[0] + times_s[-1])
        if path.times_s[-1] < needed_s - 1e-6:
            raise InputError(
                f"trajectory: it ends at {path.times_s[-1]:.3g} s; expected a path "
                f"until {needed_s:.3g} s: give a longer one or fewer --frames"
            )
        return asked_path(path, times_s)
    action = _driven(control.action, street, float(times_s[-1]), gone)
    level = path_of(action, np.concatenate([[0.0], times_s[times_s > 0]]))
    return Trajectory(_tilted(level, street.ground).world_from_camera[-len(times_s) :], times_s)


def free_m(street: PhotoStreet, gone: Sequence[int] = ()) -> float:
    """How far the own way is free ahead, in metres along z; infinite where nothing is in it.

    Road users whose numbers, from 1, are among ``gone`` do not count.
    """
    points = street.camera.rays() * street.depth_m[..., None]
    up = street.ground.height_m(points)
    solid = (street.depth_m > 0) & (up > _LOW_M) & (up < _HIGH_M) & (np.abs(points[..., 0]) < _HALF_WIDTH_M)
    solid &= ~np.isin(street.classes, FLAT) & ~np.isin(street.road_users, gone)
    return float(np.sort(street.depth_m[solid])[_LEAST_PX]) if solid.sum() > _LEAST_PX else float("inf")


def _driven(
    action: Action | None, street: PhotoStreet, seconds: float, gone: Sequence[int]
) -> Waypoints | Steering:
    if isinstance(action, Waypoints | Steering):
        return action
    if isinstance(action, Goal):
        return _to(action, street)
    free = max(free_m(street, gone) - _KEEP_M, 0.0)
    speed = min(DRIVEN_M_S, free / max(seconds, 1e-3))
    wheel: Four = (0.0, 0.0, 0.0, 0.0)
    if isinstance(action, Command) and action.direction == "stop":
        return Steering((0.6 * DRIVEN_M_S, 0.3 * DRIVEN_M_S, 0.1, 0.0), wheel)
    if isinstance(action, Command) and action.direction in ("left", "right"):
        speed, sign = min(_SLOWER_M_S, max(speed, 1.0)), 1 if action.direction == "left" else -1
        turned = sign * _TURN_RAD
        wheel = (0.5 * turned, turned, turned, turned)
    return Steering((speed, speed, speed, speed), wheel)


def _to(goal: Goal, street: PhotoStreet) -> Waypoints:
    """Along the circle from here, straight ahead at first, to a point of the road."""
    camera, plane = street.camera, street.ground.depth_m(street.camera)
    row = min(int(goal.row * camera.height_px), camera.height_px - 1)
    column = min(int(goal.column * camera.width_px), camera.width_px - 1)
    if not plane[row, column] < 200.0:
        raise InputError(
            f"--action goal={goal.column:g},{goal.row:g} is no point of the road: it lies at the horizon or "
            "above; choose one further down"
        )
    axes = level_axes(street.ground)
    right, _, ahead = axes.T @ (camera.rays()[row, column] * plane[row, column])
    bend = 2 * right / (right**2 + ahead**2)
    angle = 2 * np.arctan2(right, ahead)
    shares = np.array(AT_S) / AT_S[-1] * angle
    if abs(bend) < 1e-6:
        return Waypoints((0.0, 0.0, 0.0, 0.0), _four(np.array(AT_S) / AT_S[-1] * ahead))
    return Waypoints(_four((1 - np.cos(shares)) / bend), _four(np.sin(shares) / bend))


def _four(values: np.ndarray) -> Four:
    a, b, c, d = values.tolist()
    return a, b, c, d


def level_axes(ground: Ground) -> Float[np.ndarray, "3 3"]:
    """Columns: right, down and ahead over a level road, in the frame of the camera."""
    down = -ground.normal_world
    ahead = np.array([0.0, 0.0, 1.0]) - down * down[2]
    ahead /= np.linalg.norm(ahead)
    return np.column_stack([np.cross(down, ahead), down, ahead])


def _tilted(path: Trajectory, ground: Ground) -> Trajectory:
    """The path of a level camera, driven with the photo's."""
    axes = np.eye(4)
    axes[:3, :3] = level_axes(ground)
    return Trajectory(axes @ path.world_from_camera @ axes.T, path.times_s)
