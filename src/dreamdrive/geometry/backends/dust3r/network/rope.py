"""Rotary embedding of the row and the column of a token (Su et al. 2021, in two dimensions)."""

from typing import NamedTuple

import torch
from jaxtyping import Float, Int
from torch import Tensor


class Rotation(NamedTuple):
    """By what angles the channels of a head turn at each token.

    Attributes:
        cos: Cosines (..., N, C); C is the size of a head.
        sin: Sines (..., N, C).
    """

    cos: Float[Tensor, "... n c"]
    sin: Float[Tensor, "... n c"]


def grid_positions(rows: int, columns: int, device: torch.device | None = None) -> Int[Tensor, "n 2"]:
    """Row and column (N, 2) of the tokens of an image, row by row."""
    return torch.cartesian_prod(torch.arange(rows, device=device), torch.arange(columns, device=device))


def rotation(positions: Int[Tensor, "... n 2"], head_dim: int, base: float) -> Rotation:
    """The angles for tokens at integer positions.

    Args:
        positions: Row and column (..., N, 2).
        head_dim: Channels of a head, a multiple of 4: the first half turns with the row, the second with the
            column.
        base: Ratio of the fastest to the slowest angular frequency.
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
