"""The stored networks as what sampling, decoding and features ask for. Importing this loads diffusers."""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.prior.vista.condition import clip_pixels
from dreamdrive.prior.vista.kinds import MOTION_BUCKET
from dreamdrive.prior.vista.networks import Networks
from dreamdrive.prior.vista.sampler import Branches, Velocity

Images = Float[Tensor, "n 3 h w"]
"""Frames in [-1, 1]."""


@dataclass(frozen=True)
class Seen:
    """The conditions of one round.

    Attributes:
        image: Description of its first frame (D,).
        latent: That frame as the autoencoder has it, not scaled (C, h, w).
        action: Columns of the action (A,); None without one, as in SVD.
    """

    image: Float[Tensor, " d"]
    latent: Float[Tensor, "c h w"]
    action: Float[Tensor, " a"] | None


class Engine:
    """Networks at work, one at a time in memory; all but what a velocity sees lies on the CPU."""

    def __init__(self, networks: Networks) -> None:
        self.networks = networks

    def encode(self, images: Images) -> Float[Tensor, "n c y x"]:
        """Latents of frames in [-1, 1]: the mode, not scaled; one frame at a time."""
        vae = self.networks.vae()
        coded = [vae.encode(image[None].to(self._device), return_dict=False)[0].mode() for image in images]
        return torch.cat(coded)

    def decode(self, latents: Float[Tensor, "t c h w"]) -> Float[Tensor, "t 3 h2 w2"]:
        """Frames of latents that are not scaled, all at once."""
        given = latents.float().to(self._device)
        return self.networks.vae().decode(given, num_frames=len(given), return_dict=False)[0]

    def describe(self, images: Images) -> Float[Tensor, " d"]:
        """What CLIP says of one frame in [-1, 1]."""
        side_px = self.networks.stored.parts["image_encoder"].config["image_size"]
        shown = clip_pixels(images.to(self._device), side_px)
        return self.networks.image_encoder()(shown).image_embeds[0]

    def velocity(self, seen: Seen) -> Velocity:
        """The UNet without and with the conditions of a round; without them frame and action are zeros.

        One after the other, which takes half the memory of both at once.
        """

        def answer(x: Float[Tensor, "t c h w"], time: float, mask: Float[Tensor, " t"]) -> Branches:
            return self.look(seen, x, time, mask, 0.0), self.look(seen, x, time, mask, 1.0)

        return answer

    def look(
        self,
        seen: Seen,
        x: Float[Tensor, "t c h w"],
        time: float,
        mask: Float[Tensor, " t"],
        given: float = 1.0,
    ) -> Float[Tensor, "t c h w"]:
        """One look of the UNet at scaled noisy latents.

        ``time`` is 0.25 ln sigma, ``mask`` one for frames that are known; ``given`` is one with the
        conditions of the round, zero without.
        """
        unet, kind = self.networks.unet(), self.networks.stored.kind
        to = (self._device, self.networks.dtype)
        parts = [seen.image] if seen.action is None else [seen.image, seen.action.to(seen.image)]
        beside = (given * seen.latent.to(x))[None].expand(len(x), -1, -1, -1)
        ids = torch.tensor([[kind.rate_hz - 1, MOTION_BUCKET, kind.noise]], device=self._device)
        context = given * torch.cat(parts)[None, None].to(*to)
        return unet(torch.cat([x, beside], dim=1)[None].to(*to), time, context, ids, mask)[0].float()

    @property
    def _device(self) -> torch.device:
        return self.networks.device
