"""Gaussians of a photo's layers that no frame of a drive shows."""

from collections.abc import Sequence

import cv2
import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.prior.photo.layers import Layers
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians

_BEHIND = 1.03
"""Depth over that of a frame from which on a Gaussian is hidden there."""


def unseen_of(
    layers: Layers,
    velocities_m_s: Float[np.ndarray, "u 3"],
    cameras: Sequence[Camera],
    depth_m: Float[np.ndarray, "f h w"],
) -> Gaussians:
    """Gaussians that are outside of all frames, or behind what these show; none of road users that move."""
    g = layers.gaussians
    stands = np.append(~velocities_m_s.any(1), True)  # the last: all else
    standing = np.ones(len(g), bool) if g.actor is None else stands[g.actor.numpy()]
    points, seen = g.means.numpy().astype(np.float64), ~standing
    for camera, exact in zip(cameras, depth_m, strict=True):
        # On a road seen at a grazing angle depth differs much from pixel to pixel.
        depth = cv2.dilate(exact, np.ones((5, 5), np.uint8))
        left = np.flatnonzero(~seen)
        at = camera.project(points[left])
        inside = camera.shows(at)
        column, row = at[inside, :2].astype(int).T
        pixel = np.clip(row, 0, len(depth) - 1), np.clip(column, 0, depth.shape[1] - 1)
        seen[left[inside]] = (exact[pixel] <= 0) | (at[inside, 2] < _BEHIND * depth[pixel])
    chosen = g.select(torch.from_numpy(np.flatnonzero(~seen)))
    return Gaussians(**{name: value for name, value in chosen.tensors().items() if name != "actor"})
