"""Texture of ground that a photo does not show, from before and behind that place along the road."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, UInt8

from dreamdrive.prior.photo.way import level_axes
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground

AHEAD = tuple(1.03 ** np.arange(1, 34))
"""Where bare ground is looked for, as shares of the depth: farther and farther."""
AROUND = tuple(1.03 ** (side * step) for step in range(1, 34) for side in (-1, 1))
"""The same in both directions."""
_LEAST_OF, _MEAN_OF = 4, 12
"""Of how many places colours are means."""


def along_road(
    rgb: UInt8[np.ndarray, "h w 3"],
    camera: Camera,
    ground: Ground,
    wanted: Bool[np.ndarray, "h w"],
    bare: Bool[np.ndarray, "h w"],
    shares: Sequence[float],
) -> tuple[UInt8[np.ndarray, "h w 3"], Bool[np.ndarray, "h w"]]:
    """The picture with wanted ground as the mean of bare ground nearest along the road; and what is left.

    Lane lines go on straight so. What is left found too little bare ground.
    """
    ahead = level_axes(ground)[:, 2]
    points = camera.rays()[wanted] * ground.depth_m(camera)[wanted][:, None]
    sums, counts = np.zeros((len(points), 3)), np.zeros(len(points))
    for share in shares:
        at = camera.project(points + (share - 1) * points[:, 2:] * ahead)
        column, row = np.clip(at[:, :2], 0, (camera.width_px - 1, camera.height_px - 1)).astype(int).T
        found = camera.shows(at) & bare[row, column] & (counts < _MEAN_OF)
        sums[found] += rgb[row[found], column[found]]
        counts += found
    out, left = rgb.copy(), wanted.copy()
    known = counts >= _LEAST_OF
    left[wanted] = ~known
    out[wanted & ~left] = np.rint(sums[known] / counts[known, None])
    return out, left
