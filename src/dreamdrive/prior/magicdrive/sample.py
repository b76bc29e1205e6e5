"""Sampling of MagicDrive: UniPC with guidance, then the decoder, then features."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import torch
from diffusers.models.autoencoders.autoencoder_kl import AutoencoderKL
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from diffusers.schedulers.scheduling_unipc_multistep import UniPCMultistepScheduler
from jaxtyping import Float, Float16, Int, UInt8
from torch import Tensor

from dreamdrive.prior.early_features import onto_frames
from dreamdrive.prior.magicdrive.condition import Conditions, StreetCondition, see
from dreamdrive.prior.magicdrive.features import activations
from dreamdrive.prior.magicdrive.folder import DECODE_PICTURES, MagicDriveNetworks
from dreamdrive.prior.magicdrive.networks import BevControlNet, denoised
from dreamdrive.prior.pca import reduce
from dreamdrive.prior.running import check_finite, counted
from dreamdrive.progress import Progress

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
class SampleRun:
    """What one run samples: time steps at ``rate_hz``, from start noise of the seed."""

    street: StreetCondition
    parts: MagicDriveNetworks
    prompt: str
    steps: int
    seed: int
    rate_hz: float

    def about(self) -> dict[str, Any]:
        """The settings, for the clip's provenance."""
        return {
            "seed": self.seed,
            "steps": self.steps,
            "guidance": GUIDANCE,
            "prompt": self.prompt,
            "rate_hz": self.rate_hz,
            "weights": self.parts.digests,
        }


@dataclass(frozen=True)
class Generated:
    """What is made at time steps, by time, then camera: frames, latents and features.

    The features are principal components over all that was sampled; ``notes`` are for the report.
    """

    frames: UInt8[np.ndarray, "f h w 3"]
    latents: Float[np.ndarray, "f _ _ _"]
    features: Float16[np.ndarray, "f _ _ _"]
    notes: tuple[str, ...]


def generate(run: SampleRun, wanted: Int[np.ndarray, " t"], progress: Progress) -> Generated:
    """Make time steps.

    The temporal variant samples all time steps of its length, others each wanted one by itself.
    """
    parts = run.parts
    together, views = parts.settings.frames, parts.settings.views
    sampled = wanted if together == 1 else np.arange(together)
    tell = counted(progress, len(sampled) // together * (run.steps + 1) + len(wanted))
    clips, seen = list[Tensor](), list[Float16[np.ndarray, "h w c"]]()
    for steps in sampled.reshape(-1, together):
        latents, values = _sampled(run, steps / run.rate_hz, tell)
        clips.append(latents)
        seen += list(values)
    kept = np.searchsorted(sampled, wanted)
    by_time = torch.cat(clips).unflatten(0, (-1, views))[kept.tolist()]
    pictures: list[np.ndarray] = []
    for latents in by_time:
        pictures.append(decode(parts.vae, latents))
        tell()
    rows = (kept[:, None] * views + np.arange(views)).ravel()
    features, said = onto_frames(reduce(seen)[rows], parts.settings.size)
    latents = by_time.flatten(0, 1).permute(0, 2, 3, 1).cpu().numpy()
    return Generated(np.concatenate(pictures), latents, features, tuple(said))


def _sampled(
    run: SampleRun, times_s: Float[np.ndarray, " t"], tell: Callable[[], None]
) -> tuple[Float[Tensor, "bn c h w"], Float16[np.ndarray, "bn h2 w2 d"]]:
    """Latents of time steps that are sampled together, and what the UNet sees in them."""
    parts = run.parts
    conditions = see(run.street, times_s, parts.settings.map_shape[1], parts.words(run.prompt))
    no_words = parts.words("").expand_as(conditions.text)
    branches = conditions, conditions.without(parts.controlnet.null_camera, no_words)
    scheduler = unipc(parts.scheduler, run.steps, parts.device)
    noise = start_noise(run).to(parts.device)
    latents = sample(parts.unet, parts.controlnet, branches, noise, scheduler, done=tell)
    check_finite(latents, "latents")
    values = activations(parts, conditions, latents, scheduler.alphas_cumprod, run.seed)
    tell()
    return latents, values


def start_noise(run: SampleRun) -> Float[Tensor, "bn c h w"]:
    """Noise of the pictures that are sampled together.

    One for all cameras, and, since it depends on the seed alone, for all time steps that are sampled by
    themselves; the temporal variant learned from noise of its own for each picture.
    """
    random = torch.Generator().manual_seed(run.seed)
    settings, shape = run.parts.settings, run.parts.latent_shape
    count = settings.frames * settings.views
    noise = torch.randn((1 if settings.temporal is None else count, *shape), generator=random)
    return noise.expand(count, -1, -1, -1)


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
    tokens = [controlnet.tokens(branch) for branch in branches]
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
