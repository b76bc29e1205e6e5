"""Confidence taken from points that stand in front of what another image sees there with more confidence."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

_BEHIND = 0.001


def clean(
    confidence: Sequence[Float[np.ndarray, "_ _"]],
    depth: Sequence[Float[np.ndarray, "_ _"]],
    points: Sequence[Float[np.ndarray, "_ _ 3"]],
    world_from_camera: Float[np.ndarray, "n 4 4"],
    focals_px: Float[np.ndarray, " n"],
) -> list[Float[np.ndarray, "_ _"]]:
    """Confidences (H, W) of all images, 0 where a point is contradicted.

    Image after image, each of its points is seen from every other image in turn. It is contradicted where it
    would hide a point that is more than a thousandth further away and has more confidence; the confidences of
    images already done count as they now are.

    Args:
        confidence: (H, W) of each image.
        depth: Along z (H, W) of each image.
        points: World points (H, W, 3) of each image.
        world_from_camera: Poses.
        focals_px: Focal lengths; principal points are in the middle.
    """
    cleaned = [each.copy() for each in confidence]
    cameras = np.linalg.inv(world_from_camera).astype(points[0].dtype)
    for i, cloud in enumerate(points):
        for j, camera in enumerate(cameras):
            if i == j:
                continue
            height, width = depth[j].shape
            local = cloud @ camera[:3, :3].T + camera[:3, 3]
            z = local[..., 2]
            with np.errstate(divide="ignore", invalid="ignore"):
                u = np.rint(focals_px[j] * local[..., 0] / z + width / 2)
                v = np.rint(focals_px[j] * local[..., 1] / z + height / 2)
            inside = (z > 0) & (u >= 0) & (u < width) & (v >= 0) & (v < height)
            rows, columns = v[inside].astype(np.intp), u[inside].astype(np.intp)
            hides = z[inside] < (1 - _BEHIND) * depth[j][rows, columns]
            bad = np.zeros_like(inside)
            bad[inside] = hides & (cleaned[i][inside] < cleaned[j][rows, columns])
            cleaned[i][bad] = np.minimum(cleaned[i][bad], 0)
    return cleaned


def world_points(
    depth: Float[np.ndarray, "h w"], world_from_camera: Float[np.ndarray, "4 4"], focal_px: float
) -> Float[np.ndarray, "h w 3"]:
    """World points (H, W, 3) of a depth map; the principal point is in the middle, in whole pixels from 0."""
    height, width = depth.shape
    columns, rows = np.meshgrid(np.arange(width) - width / 2, np.arange(height) - height / 2)
    local = np.stack([columns * depth / focal_px, rows * depth / focal_px, depth], axis=-1)
    return (local @ world_from_camera[:3, :3].T + world_from_camera[:3, 3]).astype(depth.dtype)
