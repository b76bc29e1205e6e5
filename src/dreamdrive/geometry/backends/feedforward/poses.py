"""Poses as networks give them, made rigid transforms from camera to world."""

import numpy as np
from jaxtyping import Float
from torch import Tensor

from dreamdrive.errors import InputError


def world_from_camera(camera_from_world: Float[Tensor, "n _ 4"]) -> Float[np.ndarray, "n 4 4"]:
    """The inverses (N, 4, 4) of transforms from world to camera, (N, 3, 4) or (N, 4, 4).

    Raises:
        InputError: They are not finite.
    """
    rigid = nearest_rigid(camera_from_world)
    turned = np.swapaxes(rigid[:, :3, :3], 1, 2)
    inverse = rigid.copy()
    inverse[:, :3, :3] = turned
    inverse[:, :3, 3:] = -turned @ rigid[:, :3, 3:]
    return inverse


def nearest_rigid(matrices: Float[Tensor, "n _ 4"]) -> Float[np.ndarray, "n 4 4"]:
    """Transforms (N, 3, 4) or (N, 4, 4) with the rotations nearest to theirs, as (N, 4, 4) in float64.

    Low precision and regressed quaternions leave rotations a little off.

    Raises:
        InputError: They are not finite.
    """
    given = matrices.detach().cpu().double().numpy()
    if not np.isfinite(given).all():
        raise InputError("the network gives poses that are not finite: its weights are not what it expects")
    left, _, right = np.linalg.svd(given[:, :3, :3])
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    rigid = np.tile(np.eye(4), (len(given), 1, 1))
    rigid[:, :3, :3] = left @ right
    rigid[:, :3, 3] = given[:, :3, 3]
    return rigid
