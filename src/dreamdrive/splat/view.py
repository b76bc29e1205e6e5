"""Splatting of the scene's own noun: ``Gaussians`` seen by a ``Camera``."""

from typing import Any

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
    return seen_by(
        camera,
        gaussians.means,
        gaussians.quaternions,
        torch.exp(gaussians.log_scales),
        torch.sigmoid(gaussians.logit_opacities),
        gaussians.sh,
        channels=channels,
        screen_offsets_px=screen_offsets_px,
        sh_degree=sh_degree,
        backend=backend,
    )


def seen_by(
    camera: Camera,
    means: Float[Tensor, "n 3"],
    quaternions: Float[Tensor, "n 4"],
    scales: Float[Tensor, "n 3"],
    opacities: Float[Tensor, " n"],
    sh: Float[Tensor, "n k 3"],
    **how: Any,
) -> Render:
    """``rasterize`` for a ``Camera`` in place of its pose and pinhole."""
    pose = torch.as_tensor(camera.camera_from_world, dtype=means.dtype, device=means.device)
    names = ("fx_px", "fy_px", "cx_px", "cy_px", "width_px", "height_px")
    pinhole = {name: getattr(camera, name) for name in names}
    return rasterize(means, quaternions, scales, opacities, sh, pose, **pinhole, **how)
