"""New drives made from the recorded one: stop, turn, change lane, shift; metres, seconds, radians."""

import logging
from collections.abc import Callable
from functools import partial

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.scene.trajectory import Trajectory

TURN_RAD = np.deg2rad(30.0)
"""Change of heading of a turn."""
LANE_M = 3.5
"""Width of a lane."""
LANE_CHANGE_M = 45.0
"""Length of road a lane change takes where the drive is long enough; 4 s at 40 km/h."""
STEEPEST_RAD = np.deg2rad(20.0)
"""Largest heading across the lane in a lane change; a short drive reaches a part of the next lane."""
TIGHTEST_M = 8.0
"""Smallest radius of a turn, about that of a car at full lock; a short drive turns less than asked."""

SMOOTH_HZ = 20.0
"""Videos of drives have at least this rate: a scene has a view at any time, not only at recorded ones."""

_log = logging.getLogger("dreamdrive")

Up = Float[np.ndarray, "3"]


def forward(recorded: Trajectory, up: Up) -> Trajectory:
    """The recorded drive itself; ``up`` is not used."""
    return recorded


def stop(recorded: Trajectory, up: Up, after: float = 0.75) -> Trajectory:
    """Slow down smoothly on the recorded path, and stand from a share ``after`` of the time on."""
    share = _share(recorded.times_s) / after
    # The integral of 1 - smoothstep, which falls from the recorded pace at 0 to standing at 1.
    reached = np.where(share < 1, share - share**3 + 0.5 * share**4, 0.5)
    start_s, end_s = recorded.times_s[0], recorded.times_s[-1]
    path = recorded.at(start_s + reached * after * (end_s - start_s))
    return Trajectory(path, recorded.times_s)


def turn_left(recorded: Trajectory, up: Up, angle_rad: float = TURN_RAD) -> Trajectory:
    """Steer away to the left by ``angle_rad`` over the drive, at the recorded speed."""
    largest = recorded.length_m / TIGHTEST_M
    if abs(angle_rad) > largest:
        short = "the drive is %.1f m long and turns by %.0f of the wanted %.0f degrees"
        _log.warning(short, recorded.length_m, np.rad2deg(largest), np.rad2deg(abs(angle_rad)))
        angle_rad = float(np.clip(angle_rad, -largest, largest))
    return _steered(recorded, up, angle_rad * _smoothstep(_distance_share(recorded)))


def shift(recorded: Trajectory, up: Up, right_m: float = 2.0) -> Trajectory:
    """The recorded drive moved sideways, positive to the right; the view directions stay."""
    poses = recorded.world_from_camera.copy()
    poses[:, :3, 3] += right_m * _right(recorded, up)
    return Trajectory(poses, recorded.times_s)


def lane_right(recorded: Trajectory, up: Up, right_m: float = LANE_M) -> Trajectory:
    """Change to the lane ``right_m`` to the right; the heading follows the path."""
    change_m = min(recorded.length_m, LANE_CHANGE_M)
    # The steepest slope of smoothstep is 1.5.
    largest = float(np.tan(STEEPEST_RAD)) * change_m / 1.5
    if abs(right_m) > largest:
        short = "a drive of %.1f m is too short to change lanes: it moves %.1f of %.1f m to the side"
        _log.warning(short, recorded.length_m, largest, abs(right_m))
        right_m = float(np.clip(right_m, -largest, largest))
    if change_m == 0:
        return recorded
    before_m = 0.5 * (recorded.length_m - change_m)
    share = np.clip((_distance_share(recorded) * recorded.length_m - before_m) / change_m, 0, 1)
    slope = right_m * 6 * share * (1 - share) / change_m
    poses = recorded.world_from_camera.copy()
    poses[:, :3, 3] += (right_m * _smoothstep(share))[:, None] * _right(recorded, up)
    poses[:, :3, :3] = _about(up, -np.arctan(slope)) @ poses[:, :3, :3]
    return Trajectory(poses, recorded.times_s)


MANOEUVRES: dict[str, Callable[[Trajectory, Up], Trajectory]] = {
    "forward": forward,
    "left": turn_left,
    "right": partial(turn_left, angle_rad=-TURN_RAD),
    "stop": stop,
    "lane-left": partial(lane_right, right_m=-LANE_M),
    "lane-right": lane_right,
    "shift": shift,
}
"""What ``render --trajectory`` takes besides a file."""


def manoeuvre(name: str, recorded: Trajectory, up: Up, shift_m: float = 2.0) -> Trajectory:
    """The drive of a name in :data:`MANOEUVRES`; ``up`` points away from the ground, in the world."""
    if name not in MANOEUVRES:
        known = ", ".join(MANOEUVRES)
        raise InputError(f"unknown trajectory {name!r}; expected {known} or a file with a trajectory")
    return shift(recorded, up, shift_m) if name == "shift" else MANOEUVRES[name](recorded, up)


def resampled(path: Trajectory, fps: float) -> Trajectory:
    """A path at ``fps`` poses a second from its first to its last time."""
    start_s, end_s = float(path.times_s[0]), float(path.times_s[-1])
    times_s = start_s + np.arange(int((end_s - start_s) * fps + 1e-6) + 1) / fps
    return Trajectory(path.at(times_s), times_s)


def frame_rate(path: Trajectory) -> float:
    """Frames a second of a drive: one over the median step; 10 for a single pose."""
    return float(1 / np.median(np.diff(path.times_s))) if len(path) > 1 else 10.0


def smooth(path: Trajectory) -> Trajectory:
    """A drive with as many poses between the recorded ones as ``SMOOTH_HZ`` takes."""
    rate = frame_rate(path)
    return resampled(path, rate * float(np.ceil(SMOOTH_HZ / rate)))


def _share(values: np.ndarray) -> np.ndarray:
    """Increasing values as a share of their range; 0 where there is none."""
    span = values[-1] - values[0]
    return (values - values[0]) / span if span > 0 else np.zeros(len(values))


def _distance_share(path: Trajectory) -> np.ndarray:
    steps = np.linalg.norm(np.diff(path.positions_m, axis=0), axis=1)
    return _share(np.concatenate([[0.0], np.cumsum(steps)]))


def _smoothstep(share: np.ndarray) -> np.ndarray:
    return share**2 * (3 - 2 * share)


def _about(up: np.ndarray, angles_rad: np.ndarray) -> np.ndarray:
    """Rotations (T, 3, 3) about the up axis; a positive angle turns to the left."""
    return Rotation.from_rotvec(angles_rad[:, None] * up).as_matrix()


def _right(path: Trajectory, up: np.ndarray) -> np.ndarray:
    """Direction (T, 3) to the right of each camera, parallel to the ground."""
    right = np.cross(path.world_from_camera[:, :3, 2], up)
    return right / np.linalg.norm(right, axis=1, keepdims=True)


def _steered(path: Trajectory, up: np.ndarray, left_rad: np.ndarray) -> Trajectory:
    """The path with every step and view turned about the up axis by ``left_rad`` (T,)."""
    middle_rad = 0.5 * (left_rad[1:] + left_rad[:-1])
    steps = np.einsum("tij,tj->ti", _about(up, middle_rad), np.diff(path.positions_m, axis=0))
    poses = path.world_from_camera.copy()
    poses[1:, :3, 3] = path.positions_m[0] + np.cumsum(steps, axis=0)
    poses[:, :3, :3] = _about(up, left_rad) @ poses[:, :3, :3]
    return Trajectory(poses, path.times_s)
