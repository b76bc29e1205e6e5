"""A wanted path as Vista is told it, four waypoints in each round; and the path that an action means."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.prior.action_to_path import path_of
from dreamdrive.prior.path_to_action import from_first, waypoints
from dreamdrive.scene.action import AT_S, Steering, Waypoints
from dreamdrive.scene.trajectory import Trajectory


def waypoints_by_round(path: Trajectory, starts_s: Float[np.ndarray, " r"], last_s: float) -> list[Waypoints]:
    """The waypoints of rounds that start at ``starts_s``, each from where the path is then."""
    path = from_first(path)
    needed_s = max(last_s, float(starts_s[-1]) + AT_S[-1])
    if path.times_s[-1] < needed_s - 1e-6:
        raise InputError(
            f"trajectory: it lasts {path.times_s[-1]:.3g} s; expected at least {needed_s:.3g} s for these "
            "frames: give a longer path or fewer --frames"
        )
    knots_s = np.array([0.0, *AT_S])
    return [waypoints(Trajectory(path.at(start + knots_s), knots_s)) for start in starts_s]


def asked_path(path: Trajectory, times_s: Float[np.ndarray, " f"]) -> Trajectory:
    """The path at times of frames since the first that is made, from the first of these frames on."""
    return from_first(Trajectory(from_first(path).at(times_s), times_s))


def path_by_rounds(action: Waypoints | Steering, spans: Sequence[range], rate_hz: float) -> Trajectory:
    """The path of all frames that are made where every round is told the same action.

    The action counts from the first frame of the round, of which ``spans`` are the frames.
    """
    round_ = path_of(action, np.arange(len(spans[0])) / rate_hz).world_from_camera
    poses = round_
    for span in spans[1:]:
        poses = np.concatenate([poses[: span.start], poses[span.start] @ round_])
    return Trajectory(poses, np.arange(len(poses)) / rate_hz)
