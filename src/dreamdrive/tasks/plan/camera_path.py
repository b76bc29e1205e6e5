"""Plans of a camera's path, and paths of a camera that a plan leads."""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from dreamdrive.errors import InputError
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.tasks.plan.footprint import STILL_M
from dreamdrive.tasks.plan.instant import CAMERA_AHEAD_M, Instant, pose_of, seen_from, standing_at
from dreamdrive.tasks.plan.trajectory import FARTHEST_M, STEP_S, STEPS, Plan

_EARLIER_S = 1e-6


def plan_of_path(
    path: Trajectory, instant: Instant, now_s: float, camera_ahead_m: float = CAMERA_AHEAD_M
) -> Plan:
    """Where a camera's path leads the car in the next three seconds, or until the path ends.

    Raises:
        InputError: It ends before the first waypoint, or leads farther away than cars drive.
    """
    count = min(STEPS, int((float(path.times_s[-1]) - now_s + _EARLIER_S) / STEP_S))
    if count < 1:
        raise InputError(
            f"the drive ends at {path.times_s[-1]:g} s, and a plan from {now_s:g} s on needs {STEP_S:g} s "
            f"of it at least; it takes up to {STEP_S * STEPS:g} s"
        )
    poses = path.at(now_s + STEP_S * np.arange(1, count + 1))
    places = [pose_of(instant.level_from_world @ pose, camera_ahead_m)[:2] for pose in poses]
    waypoints_m = seen_from(instant.level_from_planning, np.stack(places))
    if np.abs(waypoints_m).max() > FARTHEST_M:
        raise InputError(
            f"the drive leads {np.abs(waypoints_m).max():.0f} m away in three seconds; expected metres, at "
            f"most {FARTHEST_M:.0f}"
        )
    return Plan(waypoints_m)


def path_of_plan(plan: Plan, instant: Instant, now_s: float, rate_hz: float) -> Trajectory:
    """The path of the camera on a car that follows a plan, from now to its last waypoint.

    The car stays on the plane of the road, and points where it drives.
    """
    knots_s = np.concatenate([[0.0], plan.times_s])
    known = np.vstack([np.zeros((1, 2)), plan.waypoints_m])
    ends = ((1, np.array([0.0, instant.speed_m_s])), (2, np.zeros(2)))
    curve = CubicSpline(knots_s, known, bc_type=ends)  # pyright: ignore[reportArgumentType]
    times_s = np.arange(int(plan.times_s[-1] * rate_hz + _EARLIER_S) + 1) / rate_hz
    yaws = _ahead(curve(times_s, 1))
    level = standing_at(instant.level_from_planning)
    poses = np.stack(
        [
            level @ _turned(place, yaw) @ instant.planning_from_camera
            for place, yaw in zip(curve(times_s), yaws, strict=True)
        ]
    )
    return Trajectory(np.linalg.inv(instant.level_from_world) @ poses, now_s + times_s)


def _ahead(velocity_m_s: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
    """How far the car is turned to the left of where it points now; where it stands, as before."""
    found, yaw = np.zeros(len(velocity_m_s)), 0.0
    for row, (x, y) in enumerate(velocity_m_s.tolist()):
        if np.hypot(x, y) > STILL_M / (2 * STEP_S):
            yaw = float(np.arctan2(-x, y))
        found[row] = yaw
    return found


def _turned(place_m: Float[np.ndarray, " 2"], left_rad: float) -> Float[np.ndarray, "4 4"]:
    found = np.eye(4)
    c, s = np.cos(left_rad), np.sin(left_rad)
    found[:2, :2], found[:2, 3] = [[c, -s], [s, c]], place_m
    return found
