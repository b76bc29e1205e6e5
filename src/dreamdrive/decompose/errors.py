"""Error maps: renders of the static fit and their distance from the frames (eq. 5-6)."""

from collections.abc import Callable

import cv2
import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.vision.windows import grown


def error_maps(
    clip: Clip, geometry: Geometry, picture: Callable[[int], Float[torch.Tensor, "h w 3"]]
) -> Float[np.ndarray, "f h w"]:
    """|I_static - I_ref| (eq. 6), mean over colour, in [0, 1].

    ``picture`` is I_static of a frame (eq. 5), on any device. Held-out frames get 0 and are not read; so do
    pixels that are invalid or fixed to the camera.
    """

    def error(frame: int) -> Float[torch.Tensor, "h w"]:
        shown = picture(frame)
        reference = torch.from_numpy(clip.frames[frame] / np.float32(255)).to(shown.device)
        return (shown - reference).abs().mean(dim=2)

    seen = np.flatnonzero(~clip.held_out)
    errors = np.zeros(clip.frames.shape[:3], dtype=np.float32)
    errors[seen] = torch.stack([error(frame) for frame in seen.tolist()]).cpu().numpy()
    errors[~(clip.valid & (geometry.fixed_regions[clip.camera] == 0))] = 0
    return errors


def smoothed(errors: Float[np.ndarray, "f h w"], sigma_px: float) -> Float[np.ndarray, "f h w"]:
    """Error maps blurred over ``sigma_px``: an object fails as an area, a mis-registered edge as a line.

    The blur grows with the picture, see ``scene.windows``.
    """
    sigma_px = grown(sigma_px, errors.shape[2])
    return np.stack([cv2.GaussianBlur(error, (0, 0), sigma_px) for error in errors]) if sigma_px else errors
