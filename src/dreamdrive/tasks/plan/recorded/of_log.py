"""A moment of a recorded drive for planners and metrics: where the car was and went, and who was around."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.errors import InputError
from dreamdrive.scene.street.log import BoxTrack, Log, word_of
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.tasks.plan.agents import Agents
from dreamdrive.tasks.plan.trajectory import (
    AHEAD_RAD,
    LIDAR_AHEAD_M,
    STEP_S,
    STEPS,
    Plan,
    planning_from_ego,
    planning_poses,
    wrapped,
)

_ROAD_USERS = {"vehicle": "vehicle", "human": "human"}
_SEEN = 2
"""Least visibility of what is seen well: 40 % of it."""
_EDGE_S = 1e-3
"""A labelled time is missed by rounding."""


def poses_of_log(
    log: Log, now_s: float, times_s: Float[np.ndarray, " t"], origin_ahead_m: float = LIDAR_AHEAD_M
) -> Float[np.ndarray, "t 3"]:
    """Where the recorded car was or will be in the planning frame of now: x, y, yaw (T, 3).

    Between labelled times places are linear. Past poses are what planners extrapolate.

    Args:
        log: The drive.
        now_s: The moment, on the clock of the log.
        times_s: Times from now on (T,); below 0 in the past.
        origin_ahead_m: How far the origin of the planning frame is ahead of that of the ego frame.

    Raises:
        InputError: A time lies outside the labelled ones.
    """
    drive = drive_of_log(log, now_s, times_s)
    return planning_poses(drive.at(np.array([now_s]))[0], drive.at(now_s + times_s), origin_ahead_m)


def truth_of_log(
    log: Log,
    now_s: float,
    steps: int = STEPS,
    step_s: float = STEP_S,
    origin_ahead_m: float = LIDAR_AHEAD_M,
) -> Plan:
    """Where the recorded car went from now on, which plans are compared with.

    Raises:
        InputError: The labelled times begin after now, or end before the last step.
    """
    times_s = step_s * np.arange(1, steps + 1)
    return Plan(poses_of_log(log, now_s, times_s, origin_ahead_m)[:, :2], step_s)


def road_users_of_log(log: Log) -> tuple[BoxTrack, ...]:
    """The vehicles and people of a drive, in the order of its boxes; no cones, barriers or animals."""
    return tuple(box for box in log.boxes if word_of(box.category, _ROAD_USERS) is not None)


def agents_of_log(
    log: Log, now_s: float, times_s: Float[np.ndarray, " t"], origin_ahead_m: float = LIDAR_AHEAD_M
) -> Agents:
    """The road users of a drive, see ``road_users_of_log``, in the planning frame of now.

    A box is there between its first and its last label. It is seen if a label up to now says that 40 % of it
    or more are visible; in drives whose labels tell nothing of it, all are seen.

    Args:
        log: The drive.
        now_s: The moment, on the clock of the log.
        times_s: Times from now on (T,).
        origin_ahead_m: How far the origin of the planning frame is ahead of that of the ego frame.

    Raises:
        InputError: A time lies outside the labelled ones, where an empty street would say nothing.
    """
    now = drive_of_log(log, now_s, times_s).at(np.array([now_s]))[0]
    road_users = road_users_of_log(log)
    there = np.zeros((len(times_s), len(road_users)), bool)
    world_from_box, sizes_m = np.tile(np.eye(4), (*there.shape, 1, 1)), np.zeros((*there.shape, 2))
    for column, user in enumerate(road_users):
        for row, time_s in enumerate((now_s + times_s).tolist()):
            pose = user.pose_at(time_s)
            if pose is not None:
                there[row, column], world_from_box[row, column] = True, pose
                sizes_m[row, column] = user.size_lwh_m[user.row_at(time_s), :2]
    ego_from_box = np.linalg.inv(now) @ world_from_box
    places = planning_from_ego(ego_from_box[..., :2, 3], origin_ahead_m)
    yaws = wrapped(np.arctan2(ego_from_box[..., 1, 0], ego_from_box[..., 0, 0]) + AHEAD_RAD)
    boxes = np.concatenate([places, sizes_m, yaws[..., None]], axis=-1)
    categories = tuple(user.category for user in road_users)
    return Agents(boxes, there, categories, _seen(log, road_users, now_s))


def drive_of_log(log: Log, now_s: float, times_s: Float[np.ndarray, " t"]) -> Trajectory:
    """The path of the car over the labelled times, which cover now and all times from now on (T,).

    Raises:
        InputError: They do not.
    """
    first_s, last_s = float(log.times_s[0]), float(log.times_s[-1])
    asked = now_s + np.append(times_s, 0.0)
    # Told in the positive: a time that is no number lies nowhere.
    if not ((asked >= first_s - _EDGE_S) & (asked <= last_s + _EDGE_S)).all():
        raise InputError(
            f"{log.name} is labelled from {first_s:g} to {last_s:g} s, and {asked.min():g} to "
            f"{asked.max():g} s are asked for, at {now_s:g} s; ask for a moment farther from its ends"
        )
    return Trajectory(log.world_from_ego, log.times_s)


def _seen(log: Log, road_users: Sequence[BoxTrack], now_s: float) -> Bool[np.ndarray, " n"]:
    if not any((box.visibility > 0).any() for box in log.boxes):
        return np.ones(len(road_users), bool)
    past = [user.visibility[user.times_s <= now_s + _EDGE_S] for user in road_users]
    return np.array([(levels >= _SEEN).any() for levels in past], dtype=bool)
