"""The network of DUSt3R: a shared encoder, two decoders that attend to each other, two heads."""

from collections import OrderedDict
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.geometry.backends.dust3r.network.blocks import (
    NORM_EPS,
    DecoderBlock,
    EncoderBlock,
    Linear,
    Rotation,
    grid_positions,
    rotation,
)
from dreamdrive.geometry.backends.dust3r.network.config import NetworkConfig
from dreamdrive.geometry.backends.dust3r.network.heads import DptHead, LinearHead, Pointmap, pointmap


@dataclass(frozen=True)
class Tokens:
    """Encoded images, all of one shape: tokens row by row, each for a square of pixels."""

    values: Float[Tensor, "b n d"]
    rows: int
    columns: int


class Dust3r(nn.Module):
    """The network; the names of its parts are those of the published weights.

    ``mask_token`` is one of them and never used: it is left from pre-training.
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        self.mask_token = nn.Parameter(torch.zeros(1, 1, config.dec_dim))
        squares = nn.Conv2d(3, config.enc_dim, config.patch, config.patch)
        self.patch_embed = nn.Sequential(OrderedDict[str, nn.Module](proj=squares))
        self.enc_blocks = nn.ModuleList(
            EncoderBlock(config.enc_dim, config.enc_heads, config.hidden(config.enc_dim))
            for _ in range(config.enc_depth)
        )
        self.enc_norm = nn.LayerNorm(config.enc_dim, eps=NORM_EPS)
        self.decoder_embed = Linear(config.enc_dim, config.dec_dim)
        self.dec_blocks = _decoder(config)
        self.dec_blocks2 = _decoder(config)
        self.dec_norm = nn.LayerNorm(config.dec_dim, eps=NORM_EPS)
        head = DptHead if config.head == "dpt" else LinearHead
        self.downstream_head1, self.downstream_head2 = head(config), head(config)

    def forward(
        self, first: Float[Tensor, "b 3 h w"], second: Float[Tensor, "b 3 u v"]
    ) -> tuple[Pointmap, Pointmap]:
        """Points of both images in the frame of the first; the shapes of the two may differ."""
        return self.decode(self.encode(first), self.encode(second))

    def encode(self, images: Float[Tensor, "b 3 h w"]) -> Tokens:
        """Encode images in [-1, 1], one by one: a frame's tokens serve all its pairs."""
        (height, width), patch = images.shape[-2:], self.config.patch
        if height % patch or width % patch:
            raise ValueError(f"images are {width}x{height} px; both sides must be multiples of {patch}")
        x = self.patch_embed(images)
        tokens = Tokens(x.flatten(2).transpose(1, 2), *x.shape[-2:])
        by = self._rotation(tokens, self.config.enc_dim // self.config.enc_heads)
        x = tokens.values
        for block in self.enc_blocks:
            x = block(x, by)
        return Tokens(self.enc_norm(x), tokens.rows, tokens.columns)

    def decode(self, first: Tokens, second: Tokens) -> tuple[Pointmap, Pointmap]:
        """Points of both images of each pair in the frame of the first image."""
        taps, other_taps = self.decoded(first, second)
        # One head after the other: they are what takes the most memory.
        mine = pointmap(self.downstream_head1(taps, first.rows, first.columns), self.config)
        return mine, pointmap(self.downstream_head2(other_taps, second.rows, second.columns), self.config)

    def decoded(self, first: Tokens, second: Tokens) -> tuple[list[Tensor], list[Tensor]]:
        """For each image of the pairs its tokens as encoded and after each layer of its decoder."""
        head_dim = self.config.dec_dim // self.config.dec_heads
        by, other_by = self._rotation(first, head_dim), self._rotation(second, head_dim)
        taps, other_taps = [first.values], [second.values]
        x, y = (self.decoder_embed(tokens.values).float() for tokens in (first, second))
        for block, other_block in zip(self.dec_blocks, self.dec_blocks2, strict=True):
            # Both read what the layer before left, also of the other image.
            x, y = block(x, y, by, other_by), other_block(y, x, other_by, by)
            taps.append(x)
            other_taps.append(y)
        taps[-1], other_taps[-1] = self.dec_norm(x), self.dec_norm(y)
        return taps, other_taps

    def lower_trunk(self) -> None:
        """Turn the linear layers of encoder and decoders to bfloat16, in place, but no norms or heads."""
        for part in (self.enc_blocks, self.decoder_embed, self.dec_blocks, self.dec_blocks2):
            for layer in part.modules():
                if isinstance(layer, Linear):
                    layer.to(torch.bfloat16)

    def _rotation(self, tokens: Tokens, head_dim: int) -> Rotation:
        positions = grid_positions(tokens.rows, tokens.columns, tokens.values.device)
        return rotation(positions, head_dim, self.config.rope_base)


def _decoder(config: NetworkConfig) -> nn.ModuleList:
    return nn.ModuleList(
        DecoderBlock(config.dec_dim, config.dec_heads, config.hidden(config.dec_dim))
        for _ in range(config.dec_depth)
    )
