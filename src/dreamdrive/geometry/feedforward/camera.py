"""One pinhole for a clip from the pinholes that a network gives each frame."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.geometry.fitting import Fitting
from dreamdrive.scene.camera import Camera


@dataclass(frozen=True)
class SharedCamera:
    """The camera that took all frames, as the network has it.

    Attributes:
        camera: Pinhole of the frames with square pixels.
        spread: Robust standard deviation (1.4826 times the median distance) of the logarithm of the focal
            lengths along both axes of all frames.
    """

    camera: Camera
    spread: float


def share(intrinsics: Float[np.ndarray, "n 3 3"], how: Fitting) -> SharedCamera:
    """Medians over all frames; the focal length also over both axes.

    Args:
        intrinsics: Pinholes (N, 3, 3) in pixels of the pictures.
        how: How the pictures were made of the frames.

    Raises:
        InputError: A focal length is not positive.
    """
    focals_px = intrinsics[:, [0, 1], [0, 1]] * np.divide(how.frame_size, how.size)
    if not (focals_px > 0).all() or not np.isfinite(intrinsics).all():
        raise InputError("the network gives focal lengths that are not positive: are these its weights?")
    focal_px = float(np.median(focals_px))
    spread = 1.4826 * float(np.median(np.abs(np.log(focals_px / focal_px))))
    cx_px, cy_px = how.to_frame(np.median(intrinsics[:, :2, 2], axis=0))
    return SharedCamera(Camera(focal_px, focal_px, float(cx_px), float(cy_px), *how.frame_size), spread)
