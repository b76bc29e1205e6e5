"""Small operations on lists of poses."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp


def path_length(poses: Float[np.ndarray, "f 4 4"]) -> float:
    """Length of the way from pose to pose, in their unit."""
    return float(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).sum())


def rebase(
    world_from_camera: Float[np.ndarray, "f 4 4"], points: Float[np.ndarray, "p 3"]
) -> tuple[Float[np.ndarray, "f 4 4"], Float[np.ndarray, "p 3"]]:
    """Poses and points in the frame of the first camera; rotations are made orthonormal again."""
    rotation, centre = world_from_camera[0, :3, :3], world_from_camera[0, :3, 3]
    moved = np.tile(np.eye(4), (len(world_from_camera), 1, 1))
    turned = Rotation.from_matrix(rotation.T @ world_from_camera[:, :3, :3]).as_matrix()
    turned[0] = np.eye(3)
    moved[:, :3, :3] = turned
    moved[:, :3, 3] = (world_from_camera[:, :3, 3] - centre) @ rotation
    return moved, (points - centre) @ rotation


def fill(
    world_from_camera: Float[np.ndarray, "f 4 4"], times_s: Float[np.ndarray, " f"]
) -> Float[np.ndarray, "f 4 4"]:
    """Poses with the missing ones (NaN) interpolated in time, or carried on at constant speed at the ends."""
    known = np.flatnonzero(np.isfinite(world_from_camera[:, 0, 0]))
    if len(known) == len(world_from_camera):
        return world_from_camera.copy()
    if len(known) < 2:
        raise ValueError(f"cannot interpolate from {len(known)} poses")
    filled = world_from_camera.copy()
    slerp = Slerp(times_s[known], Rotation.from_matrix(world_from_camera[known, :3, :3]))
    for frame in np.flatnonzero(~np.isfinite(world_from_camera[:, 0, 0])):
        after = int(np.clip(np.searchsorted(known, frame), 1, len(known) - 1))
        first, second = known[after - 1], known[after]
        share = (times_s[frame] - times_s[first]) / (times_s[second] - times_s[first])
        inside = np.clip(times_s[frame], times_s[known[0]], times_s[known[-1]])
        filled[frame] = np.eye(4)
        filled[frame, :3, :3] = slerp(inside).as_matrix()
        start, end = world_from_camera[first, :3, 3], world_from_camera[second, :3, 3]
        filled[frame, :3, 3] = start + share * (end - start)
    return filled
