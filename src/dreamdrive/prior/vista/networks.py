"""The networks of a video model, one at a time in memory. Importing this loads diffusers and transformers."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

import torch
from accelerate import init_empty_weights
from diffusers.models.autoencoders.autoencoder_kl_temporal_decoder import AutoencoderKLTemporalDecoder
from torch import Tensor, nn
from transformers import CLIPVisionConfig, CLIPVisionModelWithProjection

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.keys import Part
from dreamdrive.prior.vista.kinds import VISTA, Kind
from dreamdrive.prior.vista.unet import VideoUNet, make_unet

if TYPE_CHECKING:
    from dreamdrive.prior.vista.stored import Stored


def make_empty(part: Part, config: Mapping[str, Any], kind: Kind) -> nn.Module:
    """A network of a model by the configuration of its class, whose weights take no memory yet."""
    known = {key: value for key, value in config.items() if not key.startswith("_")}
    with init_empty_weights():
        if part == "unet":
            return make_unet(known, fixed_frames=kind is VISTA)
        if part == "vae":
            return AutoencoderKLTemporalDecoder(**known)
        return CLIPVisionModelWithProjection(CLIPVisionConfig(**known))


class Networks:
    """A stored model whose networks are loaded when they are asked for; each leaves when the next one comes.

    ``half`` is whether the UNet computes in float16; the others never do.
    """

    def __init__(self, stored: "Stored", device: torch.device, *, half: bool) -> None:
        self.stored = stored
        self.device = device
        self.half = half
        self._held: tuple[Part, nn.Module] | None = None

    @property
    def dtype(self) -> torch.dtype:
        """Of the UNet."""
        return torch.float16 if self.half else torch.float32

    @property
    def per_round(self) -> int:
        """Frames that the UNet sees at once; an official single file does not tell, and has 25."""
        return int(self.stored.parts["unet"].config.get("num_frames", 25))

    def unet(self) -> VideoUNet:
        """The UNet."""
        return cast(VideoUNet, self._use("unet"))

    def vae(self) -> AutoencoderKLTemporalDecoder:
        """Encoder and decoder of frames."""
        return cast(AutoencoderKLTemporalDecoder, self._use("vae"))

    def image_encoder(self) -> CLIPVisionModelWithProjection:
        """What describes the first frame."""
        return cast(CLIPVisionModelWithProjection, self._use("image_encoder"))

    def free(self) -> None:
        """Let go of what is held."""
        self._held = None
        if self.device.type == "cuda":
            torch.cuda.empty_cache()

    def _use(self, part: Part) -> nn.Module:
        if self._held is None or self._held[0] != part:
            self.free()
            self._held = part, self._load(part)
        return self._held[1]

    def _load(self, part: Part) -> nn.Module:
        own = self.stored.parts[part]
        network = make_empty(part, own.config, self.stored.kind)
        dtype = self.dtype if part == "unet" else torch.float32
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
