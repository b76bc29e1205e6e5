"""Error maps: renders of the static fit and their distance from the frames (eq. 5-6)."""

import cv2
import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.compute.threads import one_torch_thread
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.sky import Sky
from dreamdrive.splat import render
from dreamdrive.vision.windows import grown


def error_maps(
    clip: Clip, geometry: Geometry, gaussians: Gaussians, sky: Sky, exposure: Exposure
) -> Float[np.ndarray, "f h w"]:
    """|I_static - I_ref| (eq. 6), mean over colour, in [0, 1], of the static fit (eq. 5).

    Held-out frames get 0 and are not read; so do pixels that are invalid or fixed to the camera.
    """
    errors = np.zeros(clip.frames.shape[:3], dtype=np.float32)
    for i in np.flatnonzero(~clip.held_out).tolist():
        image = static_picture(clip, geometry, gaussians, sky, exposure, i)
        reference = torch.from_numpy(clip.frames[i] / np.float32(255))
        street = geometry.fixed_regions[clip.camera[i]] == 0
        errors[i] = np.where(clip.valid[i] & street, (image - reference).abs().mean(dim=2).numpy(), 0)
    return errors


@one_torch_thread()
@torch.no_grad()
def static_picture(
    clip: Clip, geometry: Geometry, gaussians: Gaussians, sky: Sky, exposure: Exposure, frame: int
) -> Float[torch.Tensor, "h w 3"]:
    """I_static of a frame (eq. 5), in the colours of the recording."""
    camera = geometry.cameras[frame]
    rendered = render(gaussians, camera)
    image = rendered.colour + (1 - rendered.alpha)[..., None] * sky.colour(camera)
    return exposure.apply(image, float(clip.times_s[frame]), int(clip.camera[frame])).clamp(0, 1)


def smoothed(errors: Float[np.ndarray, "f h w"], sigma_px: float) -> Float[np.ndarray, "f h w"]:
    """Error maps blurred over ``sigma_px``: an object fails as an area, a mis-registered edge as a line.

    The blur grows with the picture, see ``scene.windows``.
    """
    sigma_px = grown(sigma_px, errors.shape[2])
    return np.stack([cv2.GaussianBlur(error, (0, 0), sigma_px) for error in errors]) if sigma_px else errors
