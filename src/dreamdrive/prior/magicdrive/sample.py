"""Sampling: UniPC with guidance, each branch by itself to save memory, and the decoder in chunks."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import torch
from diffusers.models.autoencoders.autoencoder_kl import AutoencoderKL
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from diffusers.schedulers.scheduling_unipc_multistep import UniPCMultistepScheduler
from jaxtyping import Bool, Float, Int, UInt8
from torch import Tensor

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


@dataclass(frozen=True)
class Conditions:
    """What time steps shall show; b time steps, n cameras, k boxes at most.

    Attributes:
        raster: The map around the car, right and forward.
        cameras: Intrinsics in pixels of the full picture, camera to LiDAR in metres.
        corners_m: Corners of the boxes in the LiDAR frame.
        classes: Classes of the boxes.
        present: Whether there is a box.
        text: Tokens of the words.
    """

    raster: Float[Tensor, "b c x y"]
    cameras: Float[Tensor, "b n 3 7"]
    corners_m: Float[Tensor, "b n k 8 3"]
    classes: Int[Tensor, "b n k"]
    present: Bool[Tensor, "b n k"]
    text: Float[Tensor, "b l e"]

    def without(
        self, null_camera: Float[Tensor, "3 7"], no_words: Float[Tensor, "b l e"], *, zero_map: bool = False
    ) -> "Conditions":
        """Those of the unconditional branch: no words, no camera, no boxes; the map stays, unless told."""
        return replace(
            self,
            raster=torch.zeros_like(self.raster) if zero_map else self.raster,
            cameras=null_camera.expand_as(self.cameras),
            corners_m=torch.zeros_like(self.corners_m),
            classes=torch.zeros_like(self.classes),
            present=torch.zeros_like(self.present),
            text=no_words,
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
    guidance: float = GUIDANCE,
    done: Callable[[], None] = lambda: None,
) -> Float[Tensor, "bn c h w"]:
    """Latents of all cameras of the time steps.

    Args:
        unet: Denoises.
        controlnet: Reads the conditions.
        branches: The conditions and those of the unconditional branch.
        noise: Of every picture, in float32, which the steps are taken in.
        scheduler: Set to its steps.
        guidance: How far to go beyond the conditional branch's wish.
        done: Called after every step.
    """
    dtype = unet.dtype
    rasters = [branch.raster.to(dtype) for branch in branches]
    tokens = [
        controlnet.tokens(b.text.to(dtype), b.cameras, b.corners_m, b.classes, b.present) for b in branches
    ]
    latents = noise
    for time in scheduler.timesteps:
        seen = latents.to(dtype)
        wanted, free = (
            denoised(unet, seen, time, words, controlnet.residuals(seen, time, words, raster)).float()
            for words, raster in zip(tokens, rasters, strict=True)
        )
        guided = free + guidance * (wanted - free)
        latents = cast(Tensor, scheduler.step(guided, time, latents, return_dict=False)[0])
        done()
    return latents


@torch.inference_mode()
def decode(vae: AutoencoderKL, latents: Float[Tensor, "bn c h w"]) -> UInt8[np.ndarray, "bn _ _ 3"]:
    """Pictures of latents, a few at a time.

    Raises:
        InputError: They are not finite.
    """
    scaled = (latents / vae.config["scaling_factor"]).to(vae.dtype)
    pictures: list[np.ndarray] = []
    for chunk in scaled.split(DECODE_PICTURES):
        decoded = vae.decode(chunk, return_dict=False)[0].float()
        check_finite(decoded, "frames")
        eight_bit = (decoded.clamp(-1, 1) + 1) * 127.5
        pictures.append(eight_bit.round().to(torch.uint8).permute(0, 2, 3, 1).cpu().numpy())
    return np.concatenate(pictures)
