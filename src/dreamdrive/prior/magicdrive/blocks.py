"""Transformer blocks that attend to the neighbouring cameras, and to other times."""

from typing import Any

import torch
from diffusers.models.attention import BasicTransformerBlock
from diffusers.models.attention_processor import Attention
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.prior.magicdrive.config import KEY_FRAMES, Temporal


def sparse_causal(frames: int) -> list[list[int]]:
    """For each frame those that the sparse causal attention covers, as the 16- and the 61-frame models do.

    The key frames before and after, the frame before, and the frame itself. A key frame attends to its
    neighbours among the key frames; at the ends, at the two next ones (16 frames) or at itself (the last of
    61). Some are listed twice, which weighs them twice.
    """
    keys = list(range(0, frames, KEY_FRAMES))
    found: list[list[int]] = []
    for frame in range(frames):
        before, after = frame - frame % KEY_FRAMES, frame - frame % KEY_FRAMES + KEY_FRAMES
        if frame % KEY_FRAMES:
            near = [before, after] if after in keys else [before - KEY_FRAMES, before]
            found.append([*near, frame - 1, frame])
        elif frame == 0:
            found.append([0, 0, KEY_FRAMES, 2 * KEY_FRAMES])
        elif frame != keys[-1]:
            found.append([frame - KEY_FRAMES, frame, frame, frame + KEY_FRAMES])
        elif frame == frames - 1:
            found.append([frame - KEY_FRAMES, frame, frame, frame])
        else:
            found.append([frame - 2 * KEY_FRAMES, frame - KEY_FRAMES, frame, frame])
    return found


class CrossViewBlock(nn.Module):
    """A block of Stable Diffusion with attention to the two neighbouring cameras before its feed-forward.

    It takes over the layers of the plain block. Rows are ordered by clip, frame, camera; the cameras form a
    ring. Names of the children are those of the published state dict.
    """

    def __init__(self, block: BasicTransformerBlock, views: int) -> None:
        super().__init__()
        self.views = views
        layers: Any = block  # some are optional there, and Stable Diffusion has them all
        self.norm1, self.norm2, self.norm3 = layers.norm1, layers.norm2, layers.norm3
        self.attn1, self.attn2, self.ff = layers.attn1, layers.attn2, layers.ff
        self.norm4, self.attn4 = nn.LayerNorm(block.dim), _attention_like(block)
        self.connector = nn.Linear(block.dim, block.dim)

    def forward(
        self, hidden_states: Float[Tensor, "b d c"], encoder_hidden_states: Tensor, **_: Any
    ) -> Float[Tensor, "b d c"]:
        """Self-attention, tokens (b, l, e), neighbours, feed-forward, each with a residual."""
        x = hidden_states
        x = x + self.attend_within(self.norm1(x))
        x = x + self.attn2(self.norm2(x), encoder_hidden_states=encoder_hidden_states)
        x = x + self.connector(self.attend_beside(self.norm4(x)))
        return x + self.ff(self.norm3(x))

    def attend_within(self, x: Float[Tensor, "b d c"]) -> Float[Tensor, "b d c"]:
        """The first attention."""
        return self.attn1(x)

    def attend_beside(self, x: Float[Tensor, "b d c"]) -> Float[Tensor, "b d c"]:
        """Attention to the camera on the left plus attention to that on the right."""
        ring = x.unflatten(0, (-1, self.views))
        sides = [ring.roll(shift, dims=1).flatten(0, 1) for shift in (1, -1)]
        left, right = (self.attn4(x, encoder_hidden_states=side) for side in sides)
        return left + right


class TemporalBlock(CrossViewBlock):
    """A cross-view block that also attends over time, as MagicDrive-t does."""

    def __init__(self, block: BasicTransformerBlock, views: int, temporal: Temporal) -> None:
        super().__init__(block, views)
        self.frames = temporal.frames
        self.sources = sparse_causal(temporal.frames) if temporal.sparse else None
        self.temp_norm, self.temp_attn = nn.LayerNorm(block.dim), _attention_like(block)
        self.temp_connector = nn.Linear(block.dim, block.dim) if temporal.connector else nn.Identity()
        self.pos_emb = _Positions(temporal.frames, block.dim) if temporal.positions else nn.Identity()

    def forward(
        self, hidden_states: Float[Tensor, "b d c"], encoder_hidden_states: Tensor, **_: Any
    ) -> Float[Tensor, "b d c"]:
        """The cross-view block, then attention of each pixel along time."""
        x = super().forward(hidden_states, encoder_hidden_states)
        return x + self.temp_connector(self.attend_along(x))

    def attend_within(self, x: Float[Tensor, "b d c"]) -> Float[Tensor, "b d c"]:
        """Attention of each frame to the pixels of its sources."""
        if self.sources is None:
            return super().attend_within(x)
        clips = x.unflatten(0, (-1, self.frames, self.views))
        out = torch.empty_like(clips)
        for frame, sources in enumerate(self.sources):
            seen = clips[:, sources].transpose(1, 2).flatten(2, 3)  # clip, camera, pixels of the sources
            own = clips[:, frame].flatten(0, 1)
            looked = self.attn1(own, encoder_hidden_states=seen.flatten(0, 1))
            out[:, frame] = looked.unflatten(0, (-1, self.views))
        return out.flatten(0, 2)

    def attend_along(self, x: Float[Tensor, "b d c"]) -> Float[Tensor, "b d c"]:
        """Attention of each pixel to itself at all times."""
        clips = x.unflatten(0, (-1, self.frames, self.views))
        lines = clips.permute(0, 2, 3, 1, 4)  # clip, camera, pixel, frame
        looked = self.temp_attn(self.temp_norm(self.pos_emb(lines.flatten(0, 2))))
        return looked.reshape(lines.shape).permute(0, 3, 1, 2, 4).flatten(0, 2)


class _Positions(nn.Module):
    """Learned positions in time, added."""

    def __init__(self, frames: int, width: int) -> None:
        super().__init__()
        self.param = nn.Parameter(torch.zeros(1, frames, width))

    def forward(self, x: Tensor) -> Tensor:
        return x + self.param


def _attention_like(block: BasicTransformerBlock) -> Attention:
    """Self-attention of the block's width and heads."""
    return Attention(
        query_dim=block.dim,
        heads=block.num_attention_heads,
        dim_head=block.attention_head_dim,
        bias=block.attention_bias,
        upcast_attention=block.attn1.upcast_attention,
    )
