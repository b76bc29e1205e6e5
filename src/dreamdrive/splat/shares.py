"""How much of a view each Gaussian makes."""

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.splat.view import render


def shares(gaussians: Gaussians, camera: Camera, of: Float[Tensor, "h w c"]) -> Float[Tensor, "n c"]:
    """What each Gaussian adds to a view, in pixels, each pixel counted as much as ``of`` says.

    It is the gradient of channels that all Gaussians share. Life spans are not applied here.
    """
    with torch.enable_grad():
        ones = torch.ones(len(gaussians), of.shape[-1], requires_grad=True)
        (render(gaussians, camera, channels=ones, sh_degree=0).channels * of).sum().backward()
    assert ones.grad is not None
    return ones.grad
