"""Epipolar errors of matched points under given poses."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.evidence import Features
from dreamdrive.scene.camera import Camera

WITHIN_PX = 2.0
_RATIO = 0.8
_MIN_BASELINE = 1e-3
"""Distance of two cameras, over the length of the path, below which no epipolar line can be told."""


@dataclass(frozen=True)
class EpipolarShare:
    """Number of matches that were judged, and the share within 2 px of the epipolar line in both frames."""

    matches: int
    share: float | None


def epipolar_share(
    found: Sequence[Features],
    camera: Camera,
    world_from_camera: Float[np.ndarray, "f 4 4"],
    gap: int,
    width_px: int,
) -> EpipolarShare:
    """Share of feature matches near their epipolar lines; wrong matches count like wrong geometry.

    Features are matched by mutual nearest neighbours that pass Lowe's ratio test (0.8), with no look at the
    geometry. Pairs of frames ``gap`` apart between which the path stands still are left out. The pinhole is
    that of the size at which features were found; the 2 px are those of frames ``width_px`` wide. Poses are
    in any unit.
    """
    positions = world_from_camera[:, :3, 3]
    least = _MIN_BASELINE * float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())
    limit = WITHIN_PX * camera.width_px / width_px
    near: list[np.ndarray] = []
    for first in range(len(found) - gap):
        second = first + gap
        if np.linalg.norm(positions[second] - positions[first]) <= least:
            continue
        here, there = match(found[first], found[second])
        fundamental = _fundamental(camera, world_from_camera[first], world_from_camera[second])
        near.append(_distance(fundamental, here, there) <= limit)
    judged = np.concatenate(near) if near else np.zeros(0, bool)
    return EpipolarShare(len(judged), float(judged.mean()) if len(judged) else None)


def match(first: Features, second: Features) -> tuple[Float[np.ndarray, "m 2"], Float[np.ndarray, "m 2"]]:
    """Positions (M, 2) of features of two frames that are each other's nearest, clearly before the next."""
    if min(len(first.keypoints_px), len(second.keypoints_px)) < 2:
        return np.zeros((0, 2), np.float32), np.zeros((0, 2), np.float32)
    one, two = first.descriptors.astype(np.float32), second.descriptors.astype(np.float32)
    # Sums of products of bytes stay below 2^24, so that float32 is exact and no order of adding shows.
    square = np.square(one).sum(axis=1)[:, None] + np.square(two).sum(axis=1) - 2 * one @ two.T
    nearest = square.argmin(axis=1)
    mutual = square.argmin(axis=0)[nearest] == np.arange(len(one))
    best, next_best = np.partition(square, 1, axis=1)[:, :2].T
    chosen: Bool[np.ndarray, " n"] = mutual & (best < _RATIO**2 * next_best)
    return first.keypoints_px[chosen], second.keypoints_px[nearest[chosen]]


def _fundamental(camera: Camera, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The matrix (3, 3) that takes a pixel of the first frame to its line in the second."""
    second_from_first = np.linalg.inv(second) @ first
    x, y, z = second_from_first[:3, 3] / np.linalg.norm(second_from_first[:3, 3])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    inverse = np.linalg.inv(camera.matrix)
    return inverse.T @ cross @ second_from_first[:3, :3] @ inverse


def _distance(fundamental: np.ndarray, here: np.ndarray, there: np.ndarray) -> Float[np.ndarray, " m"]:
    """The larger of the distances (M,) of both points of a match from their lines, in pixels."""
    one, two = (np.column_stack([points, np.ones(len(points))]) for points in (here, there))
    in_second, in_first = one @ fundamental.T, two @ fundamental
    miss = np.abs((two * in_second).sum(axis=1))
    lengths = np.minimum(*(np.linalg.norm(line[:, :2], axis=1) for line in (in_second, in_first)))
    return miss / np.maximum(lengths, 1e-12)
