"""Sampling: UniPC with guidance, each branch by itself to save memory, and the decoder in chunks."""

import warnings
from collections.abc import Callable
from typing import Any, cast

import numpy as np
import torch
from diffusers.models.autoencoders.autoencoder_kl import AutoencoderKL
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from diffusers.schedulers.scheduling_unipc_multistep import UniPCMultistepScheduler
from jaxtyping import Float, UInt8
from torch import Tensor

from dreamdrive.prior.magicdrive.condition import Conditions
from dreamdrive.prior.magicdrive.memory import DECODE_PICTURES
from dreamdrive.prior.magicdrive.networks import BevControlNet, denoised
from dreamdrive.prior.running import check_finite

GUIDANCE = 2.0
_SCHEDULE = (
    "num_train_timesteps",
    "beta_start",
    "beta_end",
    "beta_schedule",
    "trained_betas",
    "prediction_type",
)


def unipc(table: dict[str, Any], steps: int, device: torch.device | str = "cpu") -> UniPCMultistepScheduler:
    """UniPC of order 2 with the noise schedule of a ``scheduler_config.json``, ending above no noise.

    ``final_sigmas_type="sigma_min"`` is how diffusers stepped when MagicDrive was made.
    """
    schedule = {key: table[key] for key in _SCHEDULE if key in table}
    scheduler = UniPCMultistepScheduler(
        **schedule, solver_order=2, solver_type="bh2", final_sigmas_type="sigma_min"
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of how diffusers hands a tensor to NumPy
        scheduler.set_timesteps(steps, device=device)
    return scheduler


@torch.inference_mode()
def sample(
    unet: UNet2DConditionModel,
    controlnet: BevControlNet,
    branches: tuple[Conditions, Conditions],
    noise: Float[Tensor, "bn c h w"],
    scheduler: UniPCMultistepScheduler,
    done: Callable[[], None] = lambda: None,
) -> Float[Tensor, "bn c h w"]:
    """Latents of all cameras of the time steps, from the conditions and those of the unconditional branch.

    The noise of every picture is in float32, which the steps are taken in; ``done`` is called after each.
    """
    dtype = unet.dtype
    rasters = [branch.raster.to(dtype) for branch in branches]
    tokens = [
        controlnet.tokens(each.text.to(dtype), each.cameras, each.corners_m, each.classes, each.present)
        for each in branches
    ]
    latents = noise
    for time in scheduler.timesteps:
        seen = latents.to(dtype)
        wanted, free = (
            denoised(unet, seen, time, words, controlnet.residuals(seen, time, words, raster)).float()
            for words, raster in zip(tokens, rasters, strict=True)
        )
        guided = free + GUIDANCE * (wanted - free)
        latents = cast(Tensor, scheduler.step(guided, time, latents, return_dict=False)[0])
        done()
    return latents


@torch.inference_mode()
def decode(vae: AutoencoderKL, latents: Float[Tensor, "bn c h w"]) -> UInt8[np.ndarray, "bn _ _ 3"]:
    """Pictures of latents, a few at a time."""
    scaled = (latents / vae.config["scaling_factor"]).to(vae.dtype)
    pictures: list[np.ndarray] = []
    for chunk in scaled.split(DECODE_PICTURES):
        decoded = vae.decode(chunk, return_dict=False)[0].float()
        check_finite(decoded, "frames")
        eight_bit = (decoded.clamp(-1, 1) + 1) * 127.5
        pictures.append(eight_bit.round().to(torch.uint8).permute(0, 2, 3, 1).cpu().numpy())
    return np.concatenate(pictures)
