"""A path as steps from pose to pose: how Cosmos 3 is told where to drive.

Row i holds ``inv(T_i) @ T_(i+1)``, camera to world with x right, y down, z ahead: the translation in metres
times ``PER_METRE``, then the first and the second column of the rotation (Zhou et al. 2019).
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.scene.trajectory import Trajectory

PER_METRE = 1.35
"""Units of Cosmos' translations in a metre, as in NVIDIA's public examples of the domain ``av``."""


def relative_poses(path: Trajectory, steps: int, rate_hz: float) -> Float[np.ndarray, "n 9"]:
    """The first steps of a path, at a rate of their own.

    Args:
        path: The wanted path; positions are linear between its poses, rotations slerped.
        steps: How many.
        rate_hz: Steps a second.

    Raises:
        InputError: The path is shorter than that.
    """
    length_s, wanted_s = float(path.times_s[-1] - path.times_s[0]), steps / rate_hz
    if length_s < wanted_s - 1e-6:
        raise InputError(
            f"trajectory: it lasts {length_s:.3g} s; expected at least {wanted_s:.3g} s "
            f"({steps + 1} frames at {rate_hz:g} Hz)"
        )
    poses = path.at(path.times_s[0] + np.arange(steps + 1) / rate_hz)
    step = np.linalg.inv(poses[:-1]) @ poses[1:]
    return np.concatenate([PER_METRE * step[:, :3, 3], step[:, :3, 0], step[:, :3, 1]], axis=1)


def accumulated(rows: Float[np.ndarray, "n 9"]) -> Float[np.ndarray, "n1 4 4"]:
    """The poses (N + 1, 4, 4) that steps (N, 9) lead to, from the identity on; the inverse of the above."""
    poses = [np.eye(4)]
    for row in rows:
        step = np.eye(4)
        step[:3, 3] = row[:3] / PER_METRE
        x = row[3:6] / np.linalg.norm(row[3:6])
        y = row[6:9] - x * (x @ row[6:9])
        step[:3, :3] = np.column_stack([x, y / np.linalg.norm(y), np.cross(x, y / np.linalg.norm(y))])
        poses.append(poses[-1] @ step)
        # Rounding of many products must not add up to something that is no rotation.
        poses[-1][:3, :3] = Rotation.from_matrix(poses[-1][:3, :3]).as_matrix()
    return np.stack(poses)
