"""Transformer blocks of the encoder and of the decoders.

Tokens and norms are float32. The linear layers work in the type of their own weights, so that a network whose
linear layers are bfloat16 still adds up its tokens in float32.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from dreamdrive.geometry.backends.dust3r.network.rope import Rotation, rotate

NORM_EPS = 1e-6


class Linear(nn.Linear):
    """A linear layer that brings its input to the type of its weights."""

    def forward(self, input: Float[Tensor, "*b i"]) -> Float[Tensor, "*b o"]:
        """Apply to (..., in)."""
        return super().forward(input.to(self.weight.dtype))


class Attention(nn.Module):
    """Self attention.

    Attributes:
        heads: Number of heads.
    """

    def __init__(self, dim: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.qkv = Linear(dim, 3 * dim)
        self.proj = Linear(dim, dim)

    def forward(self, x: Float[Tensor, "b n d"], by: Rotation) -> Float[Tensor, "b n d"]:
        """Mix tokens (B, N, D)."""
        q, k, v = (_split(part, self.heads) for part in self.qkv(x).chunk(3, dim=-1))
        return self.proj(_attend(rotate(q, by), rotate(k, by), v))


class CrossAttention(nn.Module):
    """Attention from the tokens of one image to those of another.

    Attributes:
        heads: Number of heads.
    """

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
        """For tokens x (B, N, D), what they take from tokens y (B, M, D)."""
        q = rotate(_split(self.projq(x), self.heads), by_x)
        k = rotate(_split(self.projk(y), self.heads), by_y)
        return self.proj(_attend(q, k, _split(self.projv(y), self.heads)))


class Mlp(nn.Module):
    """Two linear layers with a GELU between."""

    def __init__(self, dim: int, hidden: int) -> None:
        super().__init__()
        self.fc1 = Linear(dim, hidden)
        self.fc2 = Linear(hidden, dim)

    def forward(self, x: Float[Tensor, "b n d"]) -> Float[Tensor, "b n d"]:
        """Apply to tokens (B, N, D)."""
        return self.fc2(functional.gelu(self.fc1(x)))


class EncoderBlock(nn.Module):
    """Self attention and two linear layers, each added to the tokens."""

    def __init__(self, dim: int, heads: int, hidden: int) -> None:
        super().__init__()
        self.norm1 = nn.LayerNorm(dim, eps=NORM_EPS)
        self.attn = Attention(dim, heads)
        self.norm2 = nn.LayerNorm(dim, eps=NORM_EPS)
        self.mlp = Mlp(dim, hidden)

    def forward(self, x: Float[Tensor, "b n d"], by: Rotation) -> Float[Tensor, "b n d"]:
        """Apply to tokens (B, N, D)."""
        x = x + self.attn(self.norm1(x), by)
        return x + self.mlp(self.norm2(x))


class DecoderBlock(EncoderBlock):
    """An encoder block with attention to the other image between its two parts."""

    def __init__(self, dim: int, heads: int, hidden: int) -> None:
        super().__init__(dim, heads, hidden)
        self.norm_y = nn.LayerNorm(dim, eps=NORM_EPS)
        self.cross_attn = CrossAttention(dim, heads)
        self.norm3 = nn.LayerNorm(dim, eps=NORM_EPS)

    def forward(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, x: Float[Tensor, "b n d"], y: Float[Tensor, "b m d"], by_x: Rotation, by_y: Rotation
    ) -> Float[Tensor, "b n d"]:
        """Apply to own tokens x (B, N, D), beside tokens y (B, M, D) of the other image."""
        x = x + self.attn(self.norm1(x), by_x)
        x = x + self.cross_attn(self.norm2(x), self.norm_y(y), by_x, by_y)
        return x + self.mlp(self.norm3(x))


def _split(x: Float[Tensor, "b n d"], heads: int) -> Float[Tensor, "b {heads} n c"]:
    return x.unflatten(-1, (heads, -1)).transpose(1, 2)


def _attend(
    q: Float[Tensor, "b heads n c"], k: Float[Tensor, "b heads m c"], v: Float[Tensor, "b heads m c"]
) -> Float[Tensor, "b n d"]:
    return functional.scaled_dot_product_attention(q, k, v).transpose(1, 2).flatten(2)


def lower(module: nn.Module) -> None:
    """Turn the linear layers inside a module to bfloat16, in place; norms stay float32."""
    for part in module.modules():
        if isinstance(part, Linear):
            part.to(torch.bfloat16)
