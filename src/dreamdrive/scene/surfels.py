"""Discs on surfaces that a picture with depth shows."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.scene.camera import Camera

DEPTH_EDGE = 0.08
"""Relative depth step above which neighbouring pixels are taken to lie on different surfaces."""
MAX_STRETCH = 3.0
"""Of a disc seen at a grazing angle along its surface, where more frames than one show that."""
THICKNESS = 0.3
"""Of a disc, over the distance between pixels on it."""


def tangents(camera: Camera, depth_m: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w 2 3"]:
    """Steps on the surface from each pixel to the next one across and down, in the frame of the camera.

    Across an edge in depth the surface is taken to face the camera.
    """
    points = camera.rays() * depth_m[..., None]
    steps = [_step(points, depth_m, focal, axis) for axis, focal in ((1, camera.fx_px), (0, camera.fy_px))]
    return np.stack(steps, axis=2)


def surfels(
    steps: Float[np.ndarray, "n 2 3"], spacing_m: Float[np.ndarray, " n"], most_stretch: float = MAX_STRETCH
) -> tuple[Float[np.ndarray, "n 4"], Float[np.ndarray, "n 3"]]:
    """Rotations (N, 4) wxyz and extents (N, 3) of discs that lie on the surface, touching each other.

    Args:
        steps: To the neighbours across and down, as of ``tangents``.
        spacing_m: Distance between neighbours on a surface that faces the camera.
        most_stretch: How many of these distances a disc seen at a grazing angle may reach along its surface.
    """
    first, second = steps[:, 0], steps[:, 1]
    normal = _unit(np.cross(first, second))
    x_axis = _unit(first - (first * normal).sum(1, keepdims=True) * normal)
    y_axis = np.cross(normal, x_axis)
    quaternions = Rotation.from_matrix(np.stack([x_axis, y_axis, normal], axis=2)).as_quat()[:, [3, 0, 1, 2]]
    along = np.stack([np.abs((first * x_axis).sum(1)), np.abs((second * y_axis).sum(1))], axis=1)
    along = np.clip(along, spacing_m[:, None], most_stretch * spacing_m[:, None])
    return quaternions, np.concatenate([along, THICKNESS * spacing_m[:, None]], axis=1)


def _step(
    points: Float[np.ndarray, "h w 3"], depth_m: Float[np.ndarray, "h w"], focal_px: float, axis: int
) -> Float[np.ndarray, "h w 3"]:
    """Step (H, W, 3) on the surface for one pixel along ``axis``."""
    ahead = np.roll(points, -1, axis) - points
    ratio = np.abs(np.roll(depth_m, -1, axis) / np.maximum(depth_m, 1e-6) - 1)
    if axis == 1:
        ratio[:, -1] = np.inf
    else:
        ratio[-1] = np.inf
    flat = np.zeros_like(points)
    flat[..., 1 - axis] = depth_m / focal_px
    return np.where((ratio < DEPTH_EDGE)[..., None], ahead, flat)


def _unit(vectors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
