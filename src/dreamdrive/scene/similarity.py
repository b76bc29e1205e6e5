"""Rotation, shift and scale between two worlds, such as those of two recordings of the same cameras."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.camera import Camera

_STANDING = 1e-6


@dataclass(frozen=True)
class Similarity:
    """From points x of one world to scale * rotation @ x + translation in another."""

    scale: float
    rotation: Float[np.ndarray, "3 3"]
    translation: Float[np.ndarray, "3"]

    def __call__(self, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """The points (..., 3) brought over, in their own precision, float32 at least."""
        kind = np.result_type(points.dtype, np.float32)
        turned = points.astype(kind, copy=False) @ (self.scale * self.rotation.T).astype(kind)
        return turned + self.translation.astype(kind)


def fit_similarity(found: Sequence[Camera], true: Sequence[Camera]) -> Similarity:
    """The similarity that brings cameras nearest to the true ones, frame by frame.

    Umeyama 1991 on the positions, with the attitudes as further directions to be brought together: a straight
    drive leaves the roll about itself free, a standing camera the whole rotation. Positions, over their
    spread, and attitudes weigh alike. A camera that stands still shows no scale: it stays 1.
    """
    if len(found) != len(true) or not found:
        raise ValueError(f"similarity: {len(found)} cameras against {len(true)}; expected one pair a frame")
    here, there = (np.stack([c.world_from_camera for c in cameras]) for cameras in (found, true))
    middle, target = here[:, :3, 3].mean(axis=0), there[:, :3, 3].mean(axis=0)
    x, y = here[:, :3, 3] - middle, there[:, :3, 3] - target
    spread = float(np.sqrt(np.square(x).sum())), float(np.sqrt(np.square(y).sum()))
    moves = min(spread) > _STANDING
    together = np.einsum("fij,fkj->ik", there[:, :3, :3], here[:, :3, :3]) / (3 * len(here))
    if moves:
        together += y.T @ x / (spread[0] * spread[1])
    rotation = nearest_rotation(together)
    scale = float((y * (x @ rotation.T)).sum() / spread[0] ** 2) if moves else 1.0
    return Similarity(scale, rotation, target - scale * rotation @ middle)


def nearest_rotation(matrix: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """The right-handed rotation nearest to a matrix (3, 3)."""
    left, _, right = np.linalg.svd(matrix)
    return (left * [1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
