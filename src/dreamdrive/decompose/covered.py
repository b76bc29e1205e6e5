"""Static Gaussians that no frame has seen: always behind something that moves."""

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry

# Share of the frames a Gaussian is in view of from which it counts as covered.
COVERED_SHARE = 0.75


def covered(
    clip: Clip,
    geometry: Geometry,
    gaussians: Gaussians,
    dynamic: Bool[Tensor, " n"],
    pixels: Float[np.ndarray, "n 3"],
    spread_px: int,
) -> Bool[Tensor, " n"]:
    """Which Gaussians lie, in most of the frames they are in view of, behind pixels of dynamic ones.

    The static fit has painted them in the colours of what covers them. Left in, they shine through, and a
    view from the side shows a bright copy of the car ahead where the street was never seen.

    Args:
        clip: Which frames may be seen.
        geometry: Cameras.
        gaussians: Seeds or their static fit.
        dynamic: Labels of the vote; never covered.
        pixels: Column, row and depth of each seed in its source frame.
        spread_px: Distance between the seeds on moving things.
    """
    inside, seen = np.zeros(len(gaussians)), np.zeros(len(gaussians))
    means = gaussians.means.numpy().astype(np.float64)
    labels = dynamic.numpy()
    for frame in np.flatnonzero(~clip.held_out).tolist():
        own = labels & (gaussians.source_frame.numpy() == frame)
        nearest = _cover(clip.size, pixels[own], spread_px)
        column, row, z = geometry.cameras[frame].project(means).T
        column, row = np.floor(column), np.floor(row)
        in_view = (z > 0.2) & (column >= 0) & (column < clip.size[0])
        in_view &= (row >= 0) & (row < clip.size[1])
        where = row[in_view].astype(int), column[in_view].astype(int)
        seen += in_view
        inside[in_view] += nearest[where] < z[in_view]
    return torch.from_numpy(~labels & (seen > 0) & (inside >= COVERED_SHARE * seen))


def _cover(
    size: tuple[int, int], pixels: Float[np.ndarray, "m 3"], spread_px: int
) -> Float[np.ndarray, "h w"]:
    """Depth of the nearest dynamic seed around each pixel; infinite where there is none."""
    depth = np.full((size[1], size[0]), np.inf, dtype=np.float32)
    column = pixels[:, 0].astype(int).clip(0, size[0] - 1)
    row = pixels[:, 1].astype(int).clip(0, size[1] - 1)
    np.minimum.at(depth, (row, column), 0.9 * pixels[:, 2].astype(np.float32))
    reach = np.ones((2 * spread_px - 1, 2 * spread_px - 1), np.uint8)
    return cv2.erode(depth, reach, borderValue=float("inf"))
