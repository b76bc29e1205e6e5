"""Where static Gaussians fail: renders of the static fit and their distance from the frames (eq. 5-6)."""

from typing import Literal

import cv2
import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.features import OF_GEOMETRY, pixel_features
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.sky import Sky
from dreamdrive.splat import one_torch_thread, render, ssim_map

ErrorName = Literal["l1", "dssim", "features"]

# Features of a clip have unit variance: two deviations to either side count as all there is.
_FEATURE_RANGE = 4.0


@one_torch_thread()
@torch.no_grad()
def error_maps(
    clip: Clip, geometry: Geometry, gaussians: Gaussians, sky: Sky, exposure: Exposure, name: ErrorName = "l1"
) -> Float[np.ndarray, "f h w"]:
    """How far I_static is from I_ref, mean over colour, or Z_static from Z_ref, in [0, 1].

    Args:
        clip: The references; held-out frames get 0 and are not read.
        geometry: Cameras; pixels that are invalid or fixed to the camera get 0.
        gaussians: The static fit (eq. 5).
        sky: Its background.
        exposure: Its colour over time.
        name: ``"l1"`` is |I_static - I_ref| (eq. 6), ``"dssim"`` is (1 - SSIM) / 2, ``"features"`` the mean
            distance of the splatted features from those of the frame, where anything is splatted.

    Raises:
        ValueError: The features are asked for, and the Gaussians or the clip have none.
    """
    if name == "features" and (gaussians.features is None or not clip.features):
        raise ValueError("error_maps: the Gaussians or the clip carry no features")
    errors = np.zeros(clip.frames.shape[:3], dtype=np.float32)
    for i in np.flatnonzero(~clip.held_out).tolist():
        error = (
            _feature_error(clip, geometry, gaussians, i)
            if name == "features"
            else _colour_error(clip, geometry, gaussians, sky, exposure, name, i)
        )
        street = geometry.fixed_regions[clip.camera[i]] == 0
        errors[i] = np.where(clip.valid[i] & street, error, 0)
    return errors


def _colour_error(
    clip: Clip,
    geometry: Geometry,
    gaussians: Gaussians,
    sky: Sky,
    exposure: Exposure,
    name: ErrorName,
    frame: int,
) -> Float[np.ndarray, "h w"]:
    camera = geometry.cameras[frame]
    rendered = render(gaussians, camera)
    image = rendered.colour + (1 - rendered.alpha)[..., None] * sky.colour(camera)
    image = exposure.apply(image, float(clip.times_s[frame]), int(clip.camera[frame])).clamp(0, 1)
    reference = torch.from_numpy(clip.frames[frame] / np.float32(255))
    far = (image - reference).abs() if name == "l1" else (1 - ssim_map(image, reference)) / 2
    return far.mean(dim=2).numpy()


def _feature_error(
    clip: Clip, geometry: Geometry, gaussians: Gaussians, frame: int
) -> Float[np.ndarray, "h w"]:
    assert gaussians.features is not None
    channels = gaussians.features[:, OF_GEOMETRY:].contiguous()
    drawn = render(gaussians, geometry.cameras[frame], channels=channels, sh_degree=0)
    reference = torch.from_numpy(pixel_features(clip, geometry, frame)[..., OF_GEOMETRY:])
    far = (drawn.channels / drawn.alpha.clamp(min=1e-3)[..., None] - reference).abs().mean(dim=2)
    return ((far / _FEATURE_RANGE).clamp(0, 1) * drawn.alpha).numpy()


def smoothed(errors: Float[np.ndarray, "f h w"], sigma_px: float) -> Float[np.ndarray, "f h w"]:
    """Error maps blurred over ``sigma_px``: an object fails as an area, a mis-registered edge as a line."""
    return np.stack([cv2.GaussianBlur(error, (0, 0), sigma_px) for error in errors])
