"""A view: a picture with everything known about it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.scene.street.truth import Semantic


@dataclass(frozen=True)
class WorldView:
    """Everything known about one picture. Truth is that of the ray through the pixel's centre.

    Depth is along z, 0 in the sky; instances are labels of boxes, 0 for none; moving is what ever moves; the
    flow leads each surface point to its place in the next picture, columns and rows.
    """

    frame: UInt8[np.ndarray, "h w 3"]
    depth_m: Float[np.ndarray, "h w"]
    instance: Int[np.ndarray, "h w"]
    semantic: UInt8[np.ndarray, "h w"]
    moving: Bool[np.ndarray, "h w"]
    flow_px: Float[np.ndarray, "h w 2"]

    @property
    def sky(self) -> Bool[np.ndarray, "h w"]:
        """Sky mask (H, W)."""
        return self.semantic == Semantic.SKY
