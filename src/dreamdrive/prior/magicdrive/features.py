"""Features Z_ref of MagicDrive: activations of an early block of its UNet on its own finished pictures.

As Vista's are (``prior.vista.features``): the finished latents get a little noise and go through the UNet
once, told of cameras, boxes and words. The map takes no part: the ControlNet adds it to what leaves the
levels, not to what passes through them.
"""

import numpy as np
import torch
from jaxtyping import Float, Float16
from torch import Tensor

from dreamdrive.prior.early_features import BLOCK, SIGMA, watch
from dreamdrive.prior.magicdrive.condition import Conditions
from dreamdrive.prior.magicdrive.folder import MagicDriveNetworks
from dreamdrive.prior.magicdrive.networks import denoised
from dreamdrive.prior.running import check_finite


@torch.inference_mode()
def activations(
    parts: MagicDriveNetworks,
    conditions: Conditions,
    latents: Float[Tensor, "bn c h w"],
    kept: Float[Tensor, " t"],
    seed: int,
) -> Float16[np.ndarray, "bn h2 w2 d"]:
    """The block's activations in finished latents.

    ``kept`` is the share of the variance that is the picture's at each time of the noise schedule. The noise
    is one for all pictures, so that it makes none of them differ from the others.
    """
    time = nearest_time(kept)
    share = float(kept[time])
    random = torch.Generator().manual_seed(seed)
    drawn = torch.randn((len(latents) + 1, *latents.shape[1:]), generator=random)
    noise = drawn[-1].to(latents)  # sampling started from the others
    noisy = share**0.5 * latents + (1 - share) ** 0.5 * noise
    caught: list[Tensor] = []
    handle = watch(parts.unet, BLOCK, caught.append)
    try:
        at = torch.tensor(time, device=latents.device)
        denoised(parts.unet, noisy.to(parts.unet.dtype), at, parts.controlnet.tokens(conditions), None)
    finally:
        handle.remove()
    values = caught[0].permute(0, 2, 3, 1).half()
    check_finite(values, "features")
    return values.cpu().numpy()


def nearest_time(kept: Float[Tensor, " t"]) -> int:
    """The time of a noise schedule at which noise is ``SIGMA`` times as large as the picture."""
    return int((((1 - kept) / kept).sqrt() - SIGMA).abs().argmin())
