"""Visibility of boxes in cameras, from depth."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float

from dreamdrive.scene.camera import NEAR_M, Camera

_MARGIN_M = 0.3
"""How much nearer than a box something must be to stand before it, where depth is true."""
RECONSTRUCTED = 0.2
"""The same where depth is that of a scene, as a share of the distance. Of vehicles that are in sight a fifth
would count as hidden by themselves without it, and a twelfth with it."""
_FARTHEST_PX = 1e5

View = tuple[Camera, Float[np.ndarray, "h w"]]
"""A camera with its pose, and depth along z in metres, 0 where there is none."""


def share_seen(corners: Float[np.ndarray, "8 3"], views: Sequence[View], margin: float = 0.0) -> float:
    """Of the pixels that a box covers in all pictures, the share before which nothing stands; 0 for none.

    Args:
        corners: Of the box.
        views: Where cameras are, and what they see.
        margin: How much nearer something must be, as a share of the distance; at least 0.3 m.
    """
    covered = seen = 0
    for camera, depth_m in views:
        local = (corners - camera.world_from_camera[:3, 3]) @ camera.world_from_camera[:3, :3]
        if local[:, 2].min() < NEAR_M:
            continue
        at = local[:, :2] / local[:, 2:] * (camera.fx_px, camera.fy_px) + (camera.cx_px, camera.cy_px)
        if np.abs(at).max() > _FARTHEST_PX:
            continue
        cells = np.floor(at).astype(np.int32)
        low = np.maximum(cells.min(axis=0), 0)
        part = depth_m[low[1] : max(0, cells[:, 1].max() + 1), low[0] : max(0, cells[:, 0].max() + 1)]
        if not part.size:
            continue
        mask = np.zeros(part.shape, np.uint8)
        cv2.fillConvexPoly(mask, cv2.convexHull(cells - low), 1)
        inside = mask > 0
        nearest_m = local[:, 2].min()
        before = (part > 0) & (part < nearest_m - max(_MARGIN_M, margin * nearest_m))
        covered += int(inside.sum())
        seen += int((inside & ~before).sum())
    return seen / covered if covered else 0.0


def level_of(share: float) -> int:
    """The level of visibility in nuScenes' words: 1 below 40 %, 2 to 60, 3 to 80, 4 above."""
    return 1 + int(np.searchsorted([0.4, 0.6, 0.8], share, side="right"))
