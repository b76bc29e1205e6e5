"""Gaussians for pixels of a view whose colour and depth are a guess."""

import numpy as np
import torch
from jaxtyping import Float

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import SH_C0, Gaussians

_FOOTPRINT = 0.6  # deviation over the distance of neighbours
_LOGIT = 3.0


def surface(
    camera: Camera,
    pixels: Float[np.ndarray, "n 3"],
    colours: Float[np.ndarray, "n 3"],
    view: int,
) -> Gaussians:
    """A ball for each place (column, row, depth in metres), as large as their distance in the view.

    Colours are in [0, 1]; ``view`` is the recorded one that it is nearest to. All are marked as filled.
    """
    count = len(pixels)
    size_m = torch.from_numpy(_FOOTPRINT * pixels[:, 2] / camera.fx_px).float()
    return Gaussians(
        means=torch.from_numpy(camera.lift(pixels)).float(),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=size_m.clamp(min=1e-4).log()[:, None].repeat(1, 3),
        logit_opacities=torch.full((count,), _LOGIT),
        sh=((torch.from_numpy(colours).float() - 0.5) / SH_C0)[:, None],
        source_frame=torch.full((count,), view, dtype=torch.int64),
        filled=torch.ones(count, dtype=torch.bool),
    )
