"""Frame-to-frame odometry: what remains when structure from motion cannot be believed."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.spatial.transform import Rotation

from dreamdrive.geometry.evidence import track
from dreamdrive.geometry.road import Pair, RoadSweep
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground

STILL_PX, MOVING_PX = 0.35, 1.0
ESSENTIAL_PX = 0.8
MAX_OFF_AXIS_DEG = 30.0
DEFAULT_SPEED_M_S = 8.0
SPEEDS_M_S = (0.5, 45.0)
STEPS = 40
JUMP_COST = 0.6
ZERO_COST = 0.02
MIN_CLEAR = 0.03
STEADY_S = 2.0


@dataclass(frozen=True)
class Odometry:
    """Poses and steps in metres, the first pose the identity: a path without a map.

    The lengths were measured on the road, or else a constant speed was assumed.
    """

    world_from_camera: Float[np.ndarray, "f 4 4"]
    step_m: Float[np.ndarray, " s"]
    measured: bool


def drive(
    grey: UInt8[np.ndarray, "f h w"],
    usable: Bool[np.ndarray, "f h w"],
    camera: Camera,
    times_s: Float[np.ndarray, " f"],
    ground: Ground,
) -> Odometry:
    """Rotation and direction from the essential matrix of tracked corners, step length from the road.

    Frames and pinhole are 320 px wide; ``ground`` is the road under each camera, in its frame, along which it
    moves where corners tell no direction.
    """
    count, up = len(grey), ground.normal_world
    ahead = np.array([0.0, 0.0, 1.0])
    ahead = ahead - (ahead @ up) * up
    ahead /= np.linalg.norm(ahead)
    turns, directions = np.tile(np.eye(3), (count - 1, 1, 1)), np.zeros((count - 1, 3))
    flow = np.zeros(count - 1)
    for step in range(count - 1):
        turns[step], directions[step], flow[step] = _relative(grey, usable, camera, step, ahead)
    scores, ladder = _road_scores(grey, usable, camera, times_s, ground, turns, directions)
    lengths, measured = _lengths(scores, ladder, flow, np.diff(times_s))
    poses = np.tile(np.eye(4), (count, 1, 1))
    for step in range(count - 1):
        move = np.eye(4)
        move[:3, :3], move[:3, 3] = turns[step], directions[step] * lengths[step]
        poses[step + 1] = poses[step] @ move
    return Odometry(poses, lengths, measured)


def levelled(
    world_from_camera: Float[np.ndarray, "f 4 4"], up: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "f 4 4"]:
    """Poses as tilted as the first, whose ``up`` is given, and at its height: their errors add up to none."""
    found = world_from_camera.copy()
    for pose in found:
        upright = Rotation.align_vectors(up, pose[:3, :3] @ up)[0]
        pose[:3, :3] = upright.as_matrix() @ pose[:3, :3]
        pose[:3, 3] -= (pose[:3, 3] @ up) * up
    return found


def steadied(
    world_from_camera: Float[np.ndarray, "f 4 4"], times_s: Float[np.ndarray, " f"]
) -> Float[np.ndarray, "f 4 4"]:
    """Poses on lines through those around them: a car does not turn to and fro from frame to frame.

    In a drawn queue frames of a per-frame street are shown 0.9 dB better.
    """
    turns = Rotation.from_matrix(world_from_camera[:, :3, :3])
    values = np.column_stack([world_from_camera[:, :3, 3], (turns[0].inv() * turns).as_rotvec()])
    steady = np.empty_like(values)
    for k, t_s in enumerate(times_s):
        away_s = times_s - t_s
        weight = np.exp(-0.25 * np.square(away_s / STEADY_S))[:, None]  # the root: squares are weighed
        line = np.column_stack([np.ones_like(away_s), away_s])
        steady[k] = np.linalg.lstsq(weight * line, weight * values, rcond=None)[0][0]
    poses = world_from_camera.copy()
    poses[:, :3, :3] = (turns[0] * Rotation.from_rotvec(steady[:, 3:])).as_matrix()
    poses[:, :3, 3] = steady[:, :3]
    return poses


def _relative(
    grey: np.ndarray, usable: np.ndarray, camera: Camera, step: int, ahead: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Pose of the next camera in this one: rotation, unit direction; and the 70th percentile of the flow."""
    here, there = track(grey[step], grey[step + 1], usable[step])
    if len(here) < 12:
        return np.eye(3), ahead, np.nan
    flow = float(np.percentile(np.linalg.norm(there - here, axis=1), 70))
    if flow < STILL_PX:
        return np.eye(3), ahead, flow
    pixels, moved = here.astype(np.float64) + 0.5, there.astype(np.float64) + 0.5
    essential: Any  # None where nothing fits
    essential, inliers = cv2.findEssentialMat(
        pixels, moved, camera.matrix, method=cv2.USAC_MAGSAC, prob=0.999, threshold=ESSENTIAL_PX
    )
    if essential is None or essential.shape != (3, 3):
        return np.eye(3), ahead, flow
    _, rotation, shift, _ = cv2.recoverPose(essential, pixels, moved, camera.matrix, mask=inliers)
    turn, direction = rotation.T, (-rotation.T @ shift)[:, 0]
    if direction @ ahead < np.cos(np.radians(MAX_OFF_AXIS_DEG)):
        direction = ahead
    return turn, direction / np.linalg.norm(direction), flow


def _road_scores(
    grey: np.ndarray,
    usable: np.ndarray,
    camera: Camera,
    times_s: np.ndarray,
    ground: Ground,
    turns: np.ndarray,
    directions: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """How well a level road explains each next frame: scores (F - 1, S) and the speeds (S,) tried."""
    interval = np.diff(times_s)
    ladder = np.concatenate([[0.0], np.geomspace(*SPEEDS_M_S, STEPS)])
    scores = np.zeros((len(interval), len(ladder)))
    for step, seconds in enumerate(interval):
        poses = np.tile(np.eye(4), (2, 1, 1))
        poses[1, :3, :3], poses[1, :3, 3] = turns[step], directions[step]
        road = RoadSweep(grey[step : step + 2], usable[step : step + 2], camera, poses)
        road.telling(Pair(0, 1))
        for index, speed in enumerate(ladder):
            poses[1, :3, 3] = directions[step] * speed * seconds
            value = road.agreement(Pair(0, 1), ground.normal_world, ground.offset_m)
            scores[step, index] = value if np.isfinite(value) else 0.0
    return scores, ladder


def _lengths(
    scores: np.ndarray, ladder: np.ndarray, flow: np.ndarray, interval: np.ndarray
) -> tuple[np.ndarray, bool]:
    """Step lengths (F - 1,); a constant speed where the road shows no clear motion."""
    clear = scores.max(axis=1) - np.median(scores, axis=1) > MIN_CLEAR
    still = flow < STILL_PX
    decided = scores.copy()
    decided[still, 0] += 1.0
    decided[flow > MOVING_PX, 0] -= 1.0
    path = _viterbi(decided, ladder)
    moving = ~still
    if not moving.any() or clear[moving].mean() < 0.3 or (path[moving] > 0).mean() < 0.1:
        return np.where(still, 0.0, DEFAULT_SPEED_M_S * interval), False
    return ladder[path] * interval, True


def _viterbi(scores: np.ndarray, ladder: np.ndarray) -> np.ndarray:
    """Best sequence of speeds; a change costs in proportion to its logarithm, except to and from standing.

    Were leaving zero as dear as any change of a logarithm, a stop-and-go clip would stay at zero for good.
    """
    logs = np.log(np.maximum(ladder, 1e-9))
    change = JUMP_COST * np.abs(logs[:, None] - logs[None, :])
    change[0, 1:] = change[1:, 0] = ZERO_COST
    change[0, 0] = 0.0
    total = scores[0].copy()
    back = np.zeros(scores.shape, dtype=int)
    for step in range(1, len(scores)):
        options = total[:, None] - change
        back[step] = options.argmax(axis=0)
        total = options.max(axis=0) + scores[step]
    path = np.zeros(len(scores), dtype=int)
    path[-1] = int(total.argmax())
    for step in range(len(scores) - 1, 0, -1):
        path[step - 1] = back[step, path[step]]
    return path
