"""The stored networks, ready for sampling, decoding and features. Importing this loads diffusers."""

import logging
from dataclasses import dataclass
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.compute.machine import free_bytes
from dreamdrive.errors import InputError
from dreamdrive.prior.vista.condition import clip_pixels
from dreamdrive.prior.vista.decoder import decode_by_frames
from dreamdrive.prior.vista.keys import Part
from dreamdrive.prior.vista.kinds import MOTION_BUCKET
from dreamdrive.prior.vista.memory import Free, Job, check_memory
from dreamdrive.prior.vista.networks import make_empty
from dreamdrive.prior.vista.sampler import Branches, Velocity
from dreamdrive.prior.vista.stored import StoredModel

_log = logging.getLogger("dreamdrive")
Images = Float[Tensor, "n 3 h w"]
"""Frames in [-1, 1]."""


@dataclass(frozen=True)
class RoundConditions:
    """The conditions of one round: its first frame described, and as the autoencoder has it, not scaled.

    The columns of the action are None in SVD.
    """

    image: Float[Tensor, " d"]
    latent: Float[Tensor, "c h w"]
    action: Float[Tensor, " a"] | None


class Engine:
    """Networks at work: each is loaded when it is asked for, and leaves memory when the next one comes.

    On a GPU the UNet computes in float16, the others never do. All but what a velocity sees lies on the CPU.
    """

    def __init__(self, stored: StoredModel, device: torch.device) -> None:
        self.stored, self.device = stored, device
        self._half = device.type == "cuda"
        self._held: tuple[Part, nn.Module] | None = None

    @property
    def per_round(self) -> int:
        """Frames that the UNet sees at once; an official single file does not tell, and has 25."""
        return int(self.stored.parts["unet"].config.get("num_frames", 25))

    def check_fit(self, job: Job) -> None:
        """Tell what memory a job will take, before anything is loaded; refuse one that does not fit."""
        free = Free(free_bytes(self.device), free_bytes() if self._half else None, shared=not self._half)
        plan = check_memory(self.stored, job, free, half=self._half)
        # A warning, since less is not shown and it may be all of what the machine has.
        _log.warning("%s at %dx%d takes %s, one after the other", self.stored.kind.title, *job.size, plan)

    def network(self, part: Part) -> Any:
        """A network, loaded unless it is held."""
        if self._held is None or self._held[0] != part:
            self.free()
            self._held = part, self._load(part)
        return self._held[1]

    def free(self) -> None:
        """Let go of what is held."""
        self._held = None
        if self.device.type == "cuda":
            torch.cuda.empty_cache()

    def encode(self, images: Images) -> Float[Tensor, "n c y x"]:
        """Latents of frames in [-1, 1]: the mode, not scaled; one frame at a time."""
        vae = self.network("vae")
        coded = [vae.encode(image[None].to(self.device), return_dict=False)[0].mode() for image in images]
        return torch.cat(coded)

    def decode(self, latents: Float[Tensor, "t c h w"]) -> Float[Tensor, "t 3 h2 w2"]:
        """Frames of latents that are not scaled, mixed as if decoded all at once."""
        return decode_by_frames(self.network("vae").decoder, latents.float().to(self.device))

    def describe(self, images: Images) -> Float[Tensor, " d"]:
        """What CLIP says of one frame in [-1, 1]."""
        side_px = self.stored.parts["image_encoder"].config["image_size"]
        shown = clip_pixels(images.to(self.device), side_px)
        return self.network("image_encoder")(shown).image_embeds[0]

    def velocity(self, seen: RoundConditions) -> Velocity:
        """The UNet without and with the conditions of a round; without them frame and action are zeros.

        One after the other, which takes half the memory of both at once.
        """

        def answer(x: Float[Tensor, "t c h w"], time: float, mask: Float[Tensor, " t"]) -> Branches:
            return self.predict(seen, x, time, mask, 0.0), self.predict(seen, x, time, mask, 1.0)

        return answer

    def predict(
        self,
        seen: RoundConditions,
        x: Float[Tensor, "t c h w"],
        time: float,
        mask: Float[Tensor, " t"],
        given: float = 1.0,
    ) -> Float[Tensor, "t c h w"]:
        """One prediction of the UNet at scaled noisy latents.

        ``time`` is 0.25 ln sigma, ``mask`` one for frames that are known; ``given`` is one with the
        conditions of the round, zero without.
        """
        unet, kind = self.network("unet"), self.stored.kind
        to = (self.device, self._dtype("unet"))
        parts = [seen.image] if seen.action is None else [seen.image, seen.action.to(seen.image)]
        beside = (given * seen.latent.to(x))[None].expand(len(x), -1, -1, -1)
        ids = torch.tensor([[kind.rate_hz - 1, MOTION_BUCKET, kind.noise]], device=self.device)
        context = given * torch.cat(parts)[None, None].to(*to)
        return unet(torch.cat([x, beside], dim=1)[None].to(*to), time, context, ids, mask)[0].float()

    def _dtype(self, part: Part) -> torch.dtype:
        return torch.float16 if self._half and part == "unet" else torch.float32

    def _load(self, part: Part) -> nn.Module:
        own = self.stored.parts[part]
        network = make_empty(part, own.config, self.stored.kind)
        dtype = self._dtype(part)
        network.load_state_dict(
            {name: self._finite(name, own.read(name).to(self.device, dtype)) for name in own.shapes},
            assign=True,
        )
        # Buffers that no file holds, such as counting numbers, were made where the program runs.
        return network.to(self.device).eval().requires_grad_(False)

    def _finite(self, name: str, value: Tensor) -> Tensor:
        if not bool(torch.isfinite(value).all()):
            raise InputError(
                f"{self.stored.path}: {name} holds numbers that are not finite in {str(value.dtype)[6:]}; "
                "copy the file again"
            )
        return value
