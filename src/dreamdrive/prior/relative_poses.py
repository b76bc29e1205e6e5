"""A path as steps from pose to pose: how Cosmos 3 is told where to drive.

Row i holds ``inv(T_i) @ T_(i+1)``, camera to world with x right, y down, z ahead: the translation in metres
times ``PER_METRE``, then the first and the second column of the rotation (Zhou et al. 2019).
"""

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.scene.trajectory import Trajectory

PER_METRE = 1.35
"""Units of Cosmos' translations in a metre, as in NVIDIA's public examples of the domain ``av``."""


def relative_poses(path: Trajectory, steps: int, rate_hz: float) -> Float[np.ndarray, "n 9"]:
    """The first steps (N, 9) of a path; positions are linear between its poses, rotations slerped.

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
