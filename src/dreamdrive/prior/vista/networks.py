"""The networks of SVD and Vista: diffusers' own, with what Vista adds. Importing this loads diffusers."""

from collections.abc import Mapping
from typing import Any

import torch
from accelerate import init_empty_weights
from diffusers.models.autoencoders.autoencoder_kl_temporal_decoder import AutoencoderKLTemporalDecoder
from diffusers.models.embeddings import TimestepEmbedding
from diffusers.models.resnet import ResnetBlock2D, TemporalResnetBlock
from diffusers.models.unets.unet_spatio_temporal_condition import UNetSpatioTemporalConditionModel
from jaxtyping import Float
from torch import Tensor, nn
from transformers import CLIPVisionConfig, CLIPVisionModelWithProjection

from dreamdrive.prior.vista.keys import Part
from dreamdrive.prior.vista.kinds import VISTA, ModelKind

_EPS = 1e-5
"""Of the residual blocks' normalisations in Stability's code; diffusers has 1e-6 in 72 of them."""


class _Change:
    """What a prediction for a clip adds to the embedding of each frame (B T, D), None where none is known.

    The hooks of the blocks must not hold the network: it would hold itself by them, and stay in memory after
    its last use.
    """

    value: Tensor | None = None

    def __call__(
        self, block: nn.Module, args: tuple[Any, ...], kwargs: dict[str, Any]
    ) -> tuple[tuple[Any, ...], dict[str, Any]] | None:
        """Before a block: the embedding that frames of a clip share becomes one for each frame."""
        return None if self.value is None else (args, {**kwargs, "temb": kwargs["temb"] + self.value})


class VideoUNet(UNetSpatioTemporalConditionModel):
    """The UNet with a second time embedding, for frames that are known; SVD has none."""

    cond_time_embedding: TimestepEmbedding | None
    _change: _Change

    def forward(  # type: ignore[override]
        self,
        sample: Float[Tensor, "b t c h w"],
        time: float,
        context: Float[Tensor, "b n d"],
        time_ids: Float[Tensor, "b 3"],
        fixed: Float[Tensor, " t"] | None = None,
    ) -> Float[Tensor, "b t c2 h w"]:
        """One prediction at scaled noisy latents with the condition latents behind them.

        ``time`` is 0.25 ln sigma, ``context`` the first frame and the action, ``time_ids`` are frame rate
        - 1, motion bucket and noise on the first frame, and ``fixed`` is one for frames that are known.
        """
        times = torch.full((len(sample),), time, device=sample.device)
        try:
            if fixed is not None and self.cond_time_embedding is not None and bool(fixed.any()):
                self._change.value = self._of_fixed(times[:1], fixed.to(sample)).repeat(len(sample), 1)
            made = super().forward(sample, times, context, time_ids, return_dict=False)
        finally:
            self._change.value = None
        return made[0]

    def prepare(self, *, fixed_frames: bool) -> "VideoUNet":
        """Set the normalisations and, for frames that may be fixed (Vista), add the second embedding."""
        for module in self.modules():
            if isinstance(module, ResnetBlock2D | TemporalResnetBlock):
                module.norm1.eps = module.norm2.eps = _EPS
        self.cond_time_embedding, self._change = None, _Change()
        if fixed_frames:
            first = self.time_embedding.linear_1
            self.cond_time_embedding = TimestepEmbedding(first.in_features, first.out_features)
            for block in (*self.down_blocks, self.mid_block, *self.up_blocks):
                block.register_forward_pre_hook(self._change, with_kwargs=True)
        return self

    def _of_fixed(self, time: Float[Tensor, "1"], fixed: Float[Tensor, " t"]) -> Float[Tensor, "t d"]:
        """What to add to the embedding of each frame."""
        assert self.cond_time_embedding is not None
        encoded = self.time_proj(time).to(fixed.dtype)
        change = self.cond_time_embedding(encoded) - self.time_embedding(encoded)
        return fixed[:, None] * change


def make_empty(part: Part, config: Mapping[str, Any], kind: ModelKind) -> nn.Module:
    """A network of a model by the configuration of its class, whose weights take no memory yet."""
    known = {key: value for key, value in config.items() if not key.startswith("_")}
    with init_empty_weights():
        if part == "unet":
            return VideoUNet(**known).prepare(fixed_frames=kind is VISTA)
        if part == "vae":
            return AutoencoderKLTemporalDecoder(**known)
        return CLIPVisionModelWithProjection(CLIPVisionConfig(**known))
