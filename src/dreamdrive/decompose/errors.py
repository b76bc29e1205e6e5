"""Where static Gaussians fail: renders of the static fit and their distance from the frames (eq. 5-6)."""

from typing import Literal

import cv2
import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.sky import Sky
from dreamdrive.splat import one_torch_thread, render, ssim_map

ErrorName = Literal["l1", "dssim"]


@one_torch_thread()
@torch.no_grad()
def error_maps(
    clip: Clip, geometry: Geometry, gaussians: Gaussians, sky: Sky, exposure: Exposure, name: ErrorName = "l1"
) -> Float[np.ndarray, "f h w"]:
    """How far I_static is from I_ref, mean over colour, in [0, 1].

    Args:
        clip: The references; held-out frames get 0 and are not read.
        geometry: Cameras; pixels that are invalid or fixed to the camera get 0.
        gaussians: The static fit (eq. 5).
        sky: Its background.
        exposure: Its colour over time.
        name: ``"l1"`` is |I_static - I_ref| (eq. 6), ``"dssim"`` is (1 - SSIM) / 2.
    """
    errors = np.zeros(clip.frames.shape[:3], dtype=np.float32)
    for i in np.flatnonzero(~clip.held_out).tolist():
        rendered = render(gaussians, geometry.cameras[i])
        image = rendered.colour + (1 - rendered.alpha)[..., None] * sky.colour(geometry.cameras[i])
        image = exposure.apply(image, float(clip.times_s[i]), int(clip.camera[i])).clamp(0, 1)
        reference = torch.from_numpy(clip.frames[i] / np.float32(255))
        far = (image - reference).abs() if name == "l1" else (1 - ssim_map(image, reference)) / 2
        error = far.mean(dim=2).numpy()
        street = geometry.fixed_regions[clip.camera[i]] == 0
        errors[i] = np.where(clip.valid[i] & street, error, 0)
    return errors


def smoothed(errors: Float[np.ndarray, "f h w"], sigma_px: float) -> Float[np.ndarray, "f h w"]:
    """Error maps blurred over ``sigma_px``: an object fails as an area, a mis-registered edge as a line."""
    return np.stack([cv2.GaussianBlur(error, (0, 0), sigma_px) for error in errors])
