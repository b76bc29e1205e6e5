"""The camera of edition 1, whatever the lens of the layout: 64 degrees wide and level."""

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.camera import Camera
from streetworld.engine.lens import AHEAD

_FOCAL = 0.8
"""Of the width."""


def pinhole(size: tuple[int, int]) -> Camera:
    """The camera for pictures of a width and height in pixels."""
    focal_px = _FOCAL * size[0]
    return Camera(focal_px, focal_px, size[0] / 2, size[1] / 2, *size)


def level_from_camera() -> Float[np.ndarray, "3 3"]:
    """Its axes (x right, y down, z ahead) in the frame of its mount."""
    return AHEAD
