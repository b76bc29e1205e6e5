"""Small operations on lists of poses, and whether they go anywhere.

Where the camera does not, its path is noise and shows no unit.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp

from dreamdrive.errors import InputError
from dreamdrive.geometry.evidence import Evidence
from dreamdrive.scene.clip import Clip

STANDING_M = 0.5
"""A path in metres that nowhere leads further than this from its start may be that of a standing camera."""
_EXACT_M, _EXACT = 0.01, 1e-3  # poses that are one and the same: apart, and in the entries of the rotation
_SHOWN = 1e-3  # of the median depth: a path that spreads less is rounding


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


def stands(clip: Clip, evidence: Evidence) -> bool:
    """Whether the whole clip stands still, by the frames, and by its poses where these are in metres."""
    known = clip.known.world_from_camera
    if known is None or not clip.known.metric:
        return evidence.motion.standing
    away_m = float(np.linalg.norm(known[:, :3, 3] - known[0, :3, 3], axis=1).max())
    same = away_m < _EXACT_M and bool((np.abs(known[:, :3, :3] - known[0, :3, :3]) < _EXACT).all())
    # Traffic that fills the picture looks like a camera that moves.
    return same or (evidence.motion.standing and away_m < STANDING_M)


def without_poses(clip: Clip) -> Clip:
    """The clip as if no poses, and no points in their world, were known."""
    return replace(clip, known=replace(clip.known, world_from_camera=None, points=None))


def unit_in(
    known: Float[np.ndarray, "f 4 4"], own: Float[np.ndarray, "f 4 4"], depth: float, metric: bool = False
) -> float:
    """The unit of own poses in that of known ones: by how far both go from the middle of their paths.

    ``depth`` is the median in the unit of ``own``; with ``metric`` both units are the metre. Where one of the
    two stands still and the units are not the same, the poses are refused.
    """
    far, there = (
        float(np.linalg.norm(path - path.mean(axis=0))) for path in (known[:, :3, 3], own[:, :3, 3])
    )
    if there > _SHOWN * depth and far > 0:
        return far / there
    if metric:
        return 1.0
    which = "the given poses stand" if far == 0 else "by the network the camera stands"
    raise InputError(
        f"{which} still, but the clip does not: such poses cannot give depth its unit; leave them out, or "
        "choose frames between which the camera moves"
    )
