"""Splatting of the scene's own noun: ``Gaussians`` seen by a ``Camera``."""

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.render import Render
from dreamdrive.splat.rasterize import rasterize


def render(
    gaussians: Gaussians,
    camera: Camera,
    *,
    channels: Float[Tensor, "n c"] | None = None,
    screen_offsets_px: Float[Tensor, "n 2"] | None = None,
    sh_degree: int | None = None,
    backend: str | None = None,
) -> Render:
    """Splat Gaussians with their stored (logarithmic, logit) parameters; see ``rasterize``.

    Life spans, sky and exposure are not applied here.
    """
    pose = torch.as_tensor(
        camera.camera_from_world, dtype=gaussians.means.dtype, device=gaussians.means.device
    )
    return rasterize(
        gaussians.means,
        gaussians.quaternions,
        torch.exp(gaussians.log_scales),
        torch.sigmoid(gaussians.logit_opacities),
        gaussians.sh,
        pose,
        fx_px=camera.fx_px,
        fy_px=camera.fy_px,
        cx_px=camera.cx_px,
        cy_px=camera.cy_px,
        width_px=camera.width_px,
        height_px=camera.height_px,
        channels=channels,
        screen_offsets_px=screen_offsets_px,
        sh_degree=sh_degree,
        backend=backend,
    )
