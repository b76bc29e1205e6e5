"""Poses as files hold them: numbers that may be anything become rigid transforms."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import FARTHEST_M

RIGID_TOLERANCE = 1e-3
"""How far R R^T may be from the identity, and a quaternion's length from 1: files print few digits."""


_Row = tuple[float, float, float, float]
JsonPose = tuple[_Row, _Row, _Row, _Row]
"""A 4x4 matrix in JSON."""


@dataclass(frozen=True)
class PoseRows:
    """The poses (N, 4, 4) of a file as they stand there, in its own world; ``where`` is how messages call it.

    Times (N,) are strictly increasing, or None where the format has none.
    """

    where: str
    world_from_camera: Float[np.ndarray, "n 4 4"]
    times_s: Float[np.ndarray, " n"] | None = None

    def __len__(self) -> int:
        return len(self.world_from_camera)


def numbers(values: object, where: str) -> Float[np.ndarray, "..."]:
    """JSON values as an array."""
    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{where}: expected arrays of numbers; each pose has 4 rows of 4") from None


def pose_name(index: int) -> str:
    """What to call a pose in JSON."""
    return f"pose {index} (counted from 0)"


def clean_poses(
    poses: Float[np.ndarray, "..."], where: str, name: Callable[[int], str]
) -> Float[np.ndarray, "n 4 4"]:
    """Check each pose and take the rounding of the file out of its rotation.

    Messages call the file ``where``, and a pose what ``name`` makes of its row.
    """
    if poses.ndim != 3 or poses.shape[1:] != (4, 4) or not len(poses):
        raise InputError(f"{where}: the poses have the shape {poses.shape}; expected (N, 4, 4), N at least 1")
    for index in np.flatnonzero(~np.isfinite(poses).all(axis=(1, 2))).tolist():
        raise InputError(f"{where}: {name(index)} holds NaN or infinite numbers")
    most = np.abs(poses).max(axis=(1, 2))
    for index in np.flatnonzero(most > FARTHEST_M).tolist():
        raise InputError(
            f"{where}: {name(index)} holds {most[index]:.4g}; expected places within {FARTHEST_M:g} m of the "
            "origin: take the same offset from all of them"
        )
    rotation = poses[:, :3, :3]
    error = np.abs(rotation @ rotation.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    last = np.abs(poses[:, 3] - (0, 0, 0, 1)).max(axis=1)
    bad = (error > RIGID_TOLERANCE) | (last > RIGID_TOLERANCE) | (np.linalg.det(rotation) < 0)
    for index in np.flatnonzero(bad).tolist():
        raise InputError(
            f"{where}: {name(index)} is not rigid (R R^T differs from the identity by {error[index]:.2g}); "
            "expected a right-handed rotation without scale, and 0 0 0 1 as the last row"
        )
    left, _, right = np.linalg.svd(rotation)
    clean = np.tile(np.eye(4), (len(poses), 1, 1))
    clean[:, :3, :3] = left @ right
    clean[:, :3, 3] = poses[:, :3, 3]
    return clean
