"""The road as a plane through points of a sparse reconstruction."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

MAX_TILT_DEG = 8.0
INLIER = 0.04
BELOW = 0.25
SAMPLES = 600
REACH = 20.0


@dataclass(frozen=True)
class Plane:
    """Points x with ``normal . x + offset = 0``, in the units of the poses."""

    normal: Float[np.ndarray, "3"]  # of length 1, up
    offset: float  # height of the origin above the plane
    height: float  # mean height of the cameras above it
    support: float  # inliers, or peak of the photometric profile over its median
    share: float  # inliers over candidates, or 1
    spread: float  # of the height, relative


def up_direction(world_from_camera: Float[np.ndarray, "f 4 4"]) -> Float[np.ndarray, "3"]:
    """Mean of the cameras' up axes, made orthogonal to the path where there is one."""
    up = -world_from_camera[:, :3, 1]
    step = np.diff(world_from_camera[:, :3, 3], axis=0)
    length = np.linalg.norm(step, axis=1)
    total = up.mean(axis=0)
    if len(step) and length.max() > 0:
        long = length > 0.1 * length.max()
        along = step[long] / length[long, None]
        here = up[:-1][long]
        total = (here - (here * along).sum(axis=1, keepdims=True) * along).mean(axis=0)
    return total / np.linalg.norm(total)


def fit_points(
    points: Float[np.ndarray, "p 3"], world_from_camera: Float[np.ndarray, "f 4 4"], seed: int
) -> Plane | None:
    """RANSAC for the lowest well supported plane within 8 degrees of level.

    A plane scores its inliers (within 4 % of the camera height) minus the points more than a quarter of the
    height below it, for nothing lies under a road.
    """
    up = up_direction(world_from_camera)
    centres = world_from_camera[:, :3, 3]
    if len(points) == 0:
        return None
    apart = np.linalg.norm(points[:, None] - centres[None], axis=2)
    nearest = apart.argmin(axis=1)
    drop = (centres[nearest] - points) @ up
    below = points[(drop > 0.02 * apart.min(axis=1)) & (drop > 0)]
    if len(below) < 12:
        return None
    rng = np.random.default_rng(seed)
    picks = np.stack([rng.choice(len(below), 3, replace=False) for _ in range(SAMPLES)])
    first, second, third = below[picks[:, 0]], below[picks[:, 1]], below[picks[:, 2]]
    normals = np.cross(second - first, third - first)
    lengths = np.linalg.norm(normals, axis=1)
    usable = lengths > 1e-12
    normals = normals[usable] / lengths[usable, None]
    normals *= np.where(normals @ up < 0, -1.0, 1.0)[:, None]
    offsets = -(normals * first[usable]).sum(axis=1)
    heights = normals @ centres.mean(axis=0) + offsets
    level = (normals @ up > np.cos(np.radians(MAX_TILT_DEG))) & (heights > 0)
    if not level.any():
        return None
    normals, offsets, heights = normals[level], offsets[level], heights[level]
    distance = (below @ normals.T + offsets) / heights
    score = (np.abs(distance) < INLIER).sum(axis=0) - (distance < -BELOW).sum(axis=0)
    best = int(score.argmax())
    return _refine(below, centres, normals[best], float(offsets[best]), up)


def _refine(
    points: np.ndarray, centres: np.ndarray, normal: np.ndarray, offset: float, up: np.ndarray
) -> Plane | None:
    """Least squares on the inliers, twice; candidates are the points near the path."""
    for _ in range(2):
        height = float((centres @ normal + offset).mean())
        inliers = points[np.abs(points @ normal + offset) < INLIER * height]
        if len(inliers) < 6:
            return None
        middle = inliers.mean(axis=0)
        candidate = np.linalg.svd(inliers - middle, full_matrices=False)[2][2]
        candidate = candidate * np.sign(candidate @ up)
        if candidate @ up < np.cos(np.radians(MAX_TILT_DEG)):
            break
        normal, offset = candidate, float(-candidate @ middle)
    heights = centres @ normal + offset
    height = float(heights.mean())
    if height <= 0:
        return None
    residual = points @ normal + offset
    inlier = np.abs(residual) < INLIER * height
    around = np.linalg.norm(points[:, None] - centres[None], axis=2).min(axis=1) < REACH * height
    spread = float(residual[inlier].std() / height / np.sqrt(max(inlier.sum() / 4, 1)) + 0.005)
    return Plane(
        normal, offset, height, float(inlier.sum()), float(inlier.sum() / max(around.sum(), 1)), spread
    )
