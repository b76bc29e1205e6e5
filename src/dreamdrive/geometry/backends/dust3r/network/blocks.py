"""Transformer blocks of the encoder and of the decoders.

Tokens and norms are float32. The linear layers work in the type of their own weights, so that a network whose
linear layers are bfloat16 still adds up its tokens in float32.
"""

from collections import OrderedDict
from typing import NamedTuple

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn
from torch.nn import functional

NORM_EPS = 1e-6


class Rotation(NamedTuple):
    """Cosines and sines of the angles by which the channels of a head turn at each token."""

    cos: Float[Tensor, "... n c"]
    sin: Float[Tensor, "... n c"]


def grid_positions(rows: int, columns: int, device: torch.device | None = None) -> Int[Tensor, "n 2"]:
    """Row and column of the tokens of an image, row by row."""
    return torch.cartesian_prod(torch.arange(rows, device=device), torch.arange(columns, device=device))


def rotation(positions: Int[Tensor, "... n 2"], head_dim: int, base: float) -> Rotation:
    """Rotary embedding of the row and the column of a token (Su et al. 2021, in two dimensions).

    The first half of the channels of a head, a multiple of 4, turns with the row, the second with the column;
    ``base`` is the ratio of the fastest to the slowest angular frequency.
    """
    per_axis = head_dim // 2
    exponents = torch.arange(0, per_axis, 2, dtype=torch.float32, device=positions.device) / per_axis
    angles = positions[..., None] * base**-exponents
    angles = torch.cat([angles, angles], dim=-1).flatten(-2)
    return Rotation(angles.cos(), angles.sin())


def rotate(tokens: Float[Tensor, "b heads n c"], by: Rotation) -> Float[Tensor, "b heads n c"]:
    """Turn the channels of each head; the sums are made in float32, the type stays.

    Channels m and m + C/4 of each half of the head are the two components of one vector.
    """
    first, second = tokens.unflatten(-1, (2, 2, -1)).unbind(-2)
    turned = torch.stack([-second, first], dim=-2).flatten(-3)
    return (tokens * by.cos + turned * by.sin).to(tokens.dtype)


class Linear(nn.Linear):
    """A linear layer that brings its input to the type of its weights."""

    def forward(self, input: Float[Tensor, "*b i"]) -> Float[Tensor, "*b o"]:
        """Apply to the last axis."""
        return super().forward(input.to(self.weight.dtype))


class Attention(nn.Module):
    """Self attention."""

    def __init__(self, dim: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.qkv = Linear(dim, 3 * dim)
        self.proj = Linear(dim, dim)

    def forward(self, x: Float[Tensor, "b n d"], by: Rotation) -> Float[Tensor, "b n d"]:
        """Mix the tokens of each image."""
        q, k, v = (_split(part, self.heads) for part in self.qkv(x).chunk(3, dim=-1))
        return self.proj(_attend(rotate(q, by), rotate(k, by), v))


class _CrossAttention(nn.Module):
    """Attention from the tokens of one image to those of another."""

    def __init__(self, dim: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.projq = Linear(dim, dim)
        self.projk = Linear(dim, dim)
        self.projv = Linear(dim, dim)
        self.proj = Linear(dim, dim)

    def forward(
        self, x: Float[Tensor, "b n d"], y: Float[Tensor, "b m d"], by_x: Rotation, by_y: Rotation
    ) -> Float[Tensor, "b n d"]:
        """For tokens x, what they take from tokens y."""
        q = rotate(_split(self.projq(x), self.heads), by_x)
        k = rotate(_split(self.projk(y), self.heads), by_y)
        return self.proj(_attend(q, k, _split(self.projv(y), self.heads)))


class EncoderBlock(nn.Module):
    """Self attention and two linear layers, each added to the tokens."""

    def __init__(self, dim: int, heads: int, hidden: int) -> None:
        super().__init__()
        self.norm1 = nn.LayerNorm(dim, eps=NORM_EPS)
        self.attn = Attention(dim, heads)
        self.norm2 = nn.LayerNorm(dim, eps=NORM_EPS)
        self.mlp = nn.Sequential(
            OrderedDict[str, nn.Module](fc1=Linear(dim, hidden), gelu=nn.GELU(), fc2=Linear(hidden, dim))
        )

    def forward(self, x: Float[Tensor, "b n d"], by: Rotation) -> Float[Tensor, "b n d"]:
        """Apply to the tokens of each image."""
        x = x + self.attn(self.norm1(x), by)
        return x + self.mlp(self.norm2(x))


class DecoderBlock(EncoderBlock):
    """An encoder block with attention to the other image between its two parts."""

    def __init__(self, dim: int, heads: int, hidden: int) -> None:
        super().__init__(dim, heads, hidden)
        self.norm_y = nn.LayerNorm(dim, eps=NORM_EPS)
        self.cross_attn = _CrossAttention(dim, heads)
        self.norm3 = nn.LayerNorm(dim, eps=NORM_EPS)

    def forward(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, x: Float[Tensor, "b n d"], y: Float[Tensor, "b m d"], by_x: Rotation, by_y: Rotation
    ) -> Float[Tensor, "b n d"]:
        """Apply to own tokens x, beside tokens y of the other image."""
        x = x + self.attn(self.norm1(x), by_x)
        x = x + self.cross_attn(self.norm2(x), self.norm_y(y), by_x, by_y)
        return x + self.mlp(self.norm3(x))


def _split(x: Float[Tensor, "b n d"], heads: int) -> Float[Tensor, "b {heads} n c"]:
    return x.unflatten(-1, (heads, -1)).transpose(1, 2)


def _attend(
    q: Float[Tensor, "b heads n c"], k: Float[Tensor, "b heads m c"], v: Float[Tensor, "b heads m c"]
) -> Float[Tensor, "b n d"]:
    return functional.scaled_dot_product_attention(q, k, v).transpose(1, 2).flatten(2)
