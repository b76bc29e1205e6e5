"""A moment of a scene for a planner: where the car is, how fast, and what stands around it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.drive import CAUTIOUS, OccupancyOptions, obstacles_of
from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.tasks.plan.footprint import CAR, Footprint
from dreamdrive.tasks.plan.rectangles import inside
from dreamdrive.tasks.plan.trajectory import AHEAD_RAD

CAMERA_AHEAD_M = 0.76
"""How far the front camera of nuScenes' cars is ahead of the origin of the planning frame, its lidar."""
_FASTEST_M_S = 100.0
_SPEED_OVER_S = 0.5
_OWN_MARGIN_M = 0.3
"""What is so near to the car now is the car: its bonnet, and what is wrong before the camera."""


@dataclass(frozen=True)
class Instant:
    """Now, and what is in the way from now on.

    Attributes:
        level_from_world: To the level frame of the scene, see there.
        level_from_planning: Where the planning frame is in the level frame of the scene, and how it points:
            x, y, and the yaw of its axis ahead.
        planning_from_camera: Where the camera is on the car: x right, y ahead and z up from the road.
        speed_m_s: Of the car, over the last half second.
        yaw_rate_rad_s: The same of its direction, to the left.
        times_s: From now on (T,).
        obstacles_m: Middles of cells that are taken at these, in the planning frame.
    """

    level_from_world: Float[np.ndarray, "4 4"]
    level_from_planning: Float[np.ndarray, " 3"]
    planning_from_camera: Float[np.ndarray, "4 4"]
    speed_m_s: float
    yaw_rate_rad_s: float
    times_s: Float[np.ndarray, " t"]
    obstacles_m: tuple[Float[np.ndarray, "_ 2"], ...]


def instant_of(
    scene: Scene,
    now_s: float,
    ahead_s: Float[np.ndarray, " t"],
    options: OccupancyOptions = CAUTIOUS,
    footprint: Footprint = CAR,
    camera_ahead_m: float = CAMERA_AHEAD_M,
    path: Trajectory | None = None,
) -> Instant:
    """What a planner has at a moment of a drive.

    Args:
        scene: The scene. What moves goes on from now at the rate of its track; where the scene was made of
            later frames too, these tell its surfaces and its rate.
        now_s: The moment, on the clock of the scene.
        ahead_s: Times from now on (T,) at which what is taken is wanted.
        options: What counts as taken.
        footprint: The car; what lies in it now is left out.
        camera_ahead_m: How far the camera is ahead of the origin of plans.
        path: Of the camera; the recorded one where none is given.

    Raises:
        InputError: The scene does not know its road, is of single frames, has no such moment, or the car is
            faster than cars are.
    """
    path = scene.trajectory if path is None else path
    first_s, last_s = float(path.times_s[0]), float(path.times_s[-1])
    if not first_s <= now_s <= last_s:
        raise InputError(f"the drive lasts from {first_s:g} to {last_s:g} s, and {now_s:g} s lies outside")
    obstacles = obstacles_of(scene, [now_s + float(t_s) for t_s in ahead_s], options, now_s)
    level = obstacles.level_from_world
    since_s = min(_SPEED_OVER_S, now_s - first_s)
    if since_s <= 0:
        raise InputError(
            f"{now_s:g} s is the first moment of the drive, which tells no speed; ask for a later one"
        )
    was, now = (level @ pose for pose in path.at(np.array([now_s - since_s, now_s])))
    before, pose = pose_of(was, camera_ahead_m), pose_of(now, camera_ahead_m)
    moved = seen_from(pose, before[None, :2])[0]
    if np.hypot(*moved) > _FASTEST_M_S * since_s:
        raise InputError(
            f"the car drives at {np.hypot(*moved) / since_s:.0f} m/s at {now_s:g} s; expected at most "
            f"{_FASTEST_M_S:.0f}: the unit of the drive may be no metre"
        )
    return Instant(
        level,
        pose,
        np.linalg.inv(standing_at(pose)) @ now,
        float(-moved[1]) / since_s,
        float((pose[2] - before[2] + np.pi) % (2 * np.pi) - np.pi) / since_s,
        np.asarray(ahead_s, dtype=np.float64),
        tuple(_outside(seen_from(pose, obstacles.at(step)), footprint) for step in range(len(ahead_s))),
    )


def standing_at(pose: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "4 4"]:
    """The planning frame of a pose x, y, yaw in a level frame: x right, y ahead, z up."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    found = np.eye(4)
    found[:2, :2], found[:2, 3] = [[s, c], [-c, s]], pose[:2]
    return found


def seen_from(pose: Float[np.ndarray, " 3"], points_m: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
    """Points of a level frame in the planning frame of a pose."""
    return (points_m - pose[:2]) @ standing_at(pose)[:2, :2]


def pose_of(level_from_camera: Float[np.ndarray, "4 4"], camera_ahead_m: float) -> Float[np.ndarray, " 3"]:
    """Origin of plans and where it points, of a camera that looks ahead."""
    ahead = level_from_camera[:2, 2]
    yaw = float(np.arctan2(ahead[1], ahead[0]))
    place = level_from_camera[:2, 3] - camera_ahead_m * np.array([np.cos(yaw), np.sin(yaw)])
    return np.array([*place, yaw])


def _outside(points_m: Float[np.ndarray, "n 2"], car: Footprint) -> Float[np.ndarray, "k 2"]:
    size = car.length_m + 2 * _OWN_MARGIN_M, car.width_m + 2 * _OWN_MARGIN_M
    own = np.array([0.0, car.ahead_m, *size, AHEAD_RAD])
    return points_m[~inside(points_m, own)]
