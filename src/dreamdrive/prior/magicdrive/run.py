"""From a layout and loaded networks to pictures and their latents."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from dreamdrive.prior.magicdrive.condition import see
from dreamdrive.prior.magicdrive.folder import Parts
from dreamdrive.prior.magicdrive.sample import GUIDANCE, decode, sample, unipc
from dreamdrive.prior.running import check_finite, counted
from dreamdrive.progress import Progress
from dreamdrive.scene.layout import Layout


@dataclass(frozen=True)
class Run:
    """What one run samples: time steps at ``rate_hz``, from start noise of the seed."""

    layout: Layout
    parts: Parts
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


def generate(
    run: Run, wanted: np.ndarray, progress: Progress
) -> tuple[UInt8[np.ndarray, "f h w 3"], Float[np.ndarray, "f _ _ _"]]:
    """Frames and latents of time steps, by time, then camera.

    The temporal variant samples all time steps of its length, others each wanted one by itself.
    """
    together = run.parts.settings.frames
    sampled = wanted if together == 1 else np.arange(together)
    tell = counted(progress, len(sampled) // together * run.steps + len(wanted))
    parts = run.parts
    clips = [_sampled(run, steps / run.rate_hz, tell) for steps in sampled.reshape(-1, together)]
    by_time = torch.cat(clips).unflatten(0, (-1, parts.settings.views))
    check_finite(by_time, "latents")
    kept = by_time[np.searchsorted(sampled, wanted).tolist()]
    pictures: list[np.ndarray] = []
    for latents in kept:
        pictures.append(decode(parts.vae, latents))
        tell()
    return np.concatenate(pictures), kept.flatten(0, 1).permute(0, 2, 3, 1).cpu().numpy()


def _sampled(
    run: Run, times_s: Float[np.ndarray, " t"], tell: Callable[[], None]
) -> Float[Tensor, "bn c h w"]:
    """Latents of time steps that are sampled together."""
    parts = run.parts
    conditions = see(run.layout, times_s, parts.settings.map_shape[1], parts.words(run.prompt))
    no_words = parts.words("").expand_as(conditions.text)
    branches = conditions, conditions.without(parts.controlnet.null_camera, no_words)
    scheduler = unipc(parts.scheduler, run.steps, parts.device)
    noise = start_noise(run).to(parts.device)
    return sample(parts.unet, parts.controlnet, branches, noise, scheduler, done=tell)


def start_noise(run: Run) -> Float[Tensor, "bn c h w"]:
    """Noise of the pictures that are sampled together.

    One for all cameras, and, since it depends on the seed alone, for all time steps that are sampled by
    themselves; the temporal variant learned from noise of its own for each picture.
    """
    random = torch.Generator().manual_seed(run.seed)
    settings, shape = run.parts.settings, run.parts.latent_shape
    count = settings.frames * settings.views
    noise = torch.randn((1 if settings.temporal is None else count, *shape), generator=random)
    return noise.expand(count, -1, -1, -1)
