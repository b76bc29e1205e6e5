"""Widths of the lanes of a photo, by the lines that the street network sees on the road."""

import numpy as np
from jaxtyping import Float

from dreamdrive.prior.photo.way import level_axes
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.street.look import Look
from dreamdrive.scene.street.street_class import StreetClass

_NEAR, _FAR, _ASIDE = 3.0, 14.0, 6.0
"""Where lines are looked for: distances ahead and aside, in heights of the camera."""
_BIN = 0.1
_SLOPES = np.tan(np.linspace(-0.2, 0.2, 41))
"""Directions that the road may have, against that of the camera."""
_LEAST_PX = 60
_STRONG = 0.3
"""A line is at least this strong against the strongest one."""


def lane_widths(look: Look, camera: Camera) -> list[float]:
    """Distances between neighbouring lines of a straight road, in heights of the camera.

    Lines are peaks in where markings lie across the direction in which they lie closest together.
    """
    ground = Ground(look.camera.up_in(camera), 1.0)
    depth = ground.depth_m(camera)
    marked = (look.classes[0] == StreetClass.MARKING) & (depth > _NEAR) & (depth < _FAR)
    if marked.sum() < _LEAST_PX:
        return []
    points = (camera.rays() * depth[..., None])[marked] @ level_axes(ground)
    across = max((_spread_across(points, slope) for slope in _SLOPES), key=lambda each: (each**2).sum())
    smooth = np.convolve(across, (0.25, 0.5, 0.25), "same")
    middle = smooth[1:-1]
    peak = (middle > smooth[:-2]) & (middle >= smooth[2:]) & (middle > _STRONG * smooth.max())
    return (_BIN * np.diff(np.flatnonzero(peak))).tolist()


def _spread_across(points: Float[np.ndarray, "n 3"], slope: float) -> Float[np.ndarray, " b"]:
    """How much is marked at each place across the road; a pixel counts as the ground that it covers."""
    right, ahead = points[:, 0] - slope * points[:, 2], points[:, 2]
    bins = np.arange(-_ASIDE, _ASIDE + 0.5 * _BIN, _BIN)
    return np.histogram(right, bins, weights=np.minimum(ahead, 10.0) ** 2)[0]
