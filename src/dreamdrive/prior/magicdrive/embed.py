"""What MagicDrive's networks read beside words: Fourier features, tokens of boxes, the encoder of the map."""

from itertools import pairwise

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn
from torch.nn import functional

FREQUENCIES = 4
"""Octaves of the Fourier features, from 1."""
FEATURES = 3 * (1 + 2 * FREQUENCIES)
"""Fourier features of a point."""
CORNERS = 8


def fourier(points: Float[Tensor, "*b 3"]) -> Float[Tensor, "*b 27"]:
    """Points and the sines and cosines of 1, 2, 4 and 8 times them: v, sin v, cos v, sin 2v, cos 2v, ..."""
    waves = [wave(points * 2**octave) for octave in range(FREQUENCIES) for wave in (torch.sin, torch.cos)]
    return torch.cat([points, *waves], dim=-1)


class BoxEmbedder(nn.Module):
    """One token a box, from its corners and its class (MagicDrive's ``ContinuousBBoxWithTextEmbedding``).

    A class's token is a text encoder's output for its name; the last of the widths is that of a box's token.
    """

    def __init__(self, classes: int, class_width: int, widths: tuple[int, int, int, int]) -> None:
        super().__init__()
        first, second, third, last = widths
        self.bbox_proj = nn.Linear(CORNERS * FEATURES, first)
        self.second_linear = nn.Sequential(
            nn.Linear(first + class_width, second),
            nn.SiLU(),
            nn.Linear(second, third),
            nn.SiLU(),
            nn.Linear(third, last),
        )
        self.register_buffer("_class_tokens", torch.zeros(classes, class_width))
        self.null_class_feature = nn.Parameter(torch.zeros(class_width))
        self.null_pos_feature = nn.Parameter(torch.zeros(CORNERS * FEATURES))

    def forward(
        self,
        corners_m: Float[Tensor, "*b 8 3"],
        classes: Int[Tensor, "*b"],
        present: Bool[Tensor, "*b"],
    ) -> Float[Tensor, "*b c"]:
        """Tokens of boxes; those that are not present get the token of no box, which attention sees as well.

        Corners are in the LiDAR frame, in float32 whatever the network's type is.
        """
        there = present[..., None]
        features = fourier(corners_m.float()).flatten(-2).to(self.null_pos_feature.dtype)
        place = torch.where(there, features, self.null_pos_feature)
        tokens = self.get_buffer("_class_tokens")[classes.clamp(min=0)]
        kind = torch.where(there, tokens, self.null_class_feature)
        place = functional.silu(self.bbox_proj(place))
        return self.second_linear(torch.cat([place, kind], dim=-1))


class MapEncoder(nn.Module):
    """From the raster of the map to the first feature map of the ControlNet, through four levels.

    Of MagicDrive's 272x736 model, the result is averaged to the height and width ``pooled``; the others get
    28x50 from 200x200 cells and 53x100 from 400x400 by their paddings.
    """

    def __init__(
        self, channels: int, widths: tuple[int, ...], out: int, pooled: tuple[int, int] | None = None
    ) -> None:
        super().__init__()
        high = 1 if pooled else 2  # the padding across rows that brings 200 cells to 28
        strides: list[int | tuple[int, int]] = [1 if pooled else 2, *[2] * (len(widths) - 3), (2, 1)]
        self.conv_in = nn.Conv2d(channels, widths[0], 3, padding=1)
        blocks: list[nn.Module] = []
        for level, (narrow, wide) in enumerate(pairwise(widths)):
            last = level == len(strides) - 1
            blocks.append(nn.Conv2d(narrow, narrow, 3, padding=(high if last else 1, 1)))
            blocks.append(nn.Conv2d(narrow, wide, 3, strides[level], padding=(high, 1)))
        if pooled:
            blocks.append(nn.AdaptiveAvgPool2d(pooled))
        self.blocks = nn.ModuleList(blocks)
        self.conv_out = nn.Conv2d(widths[-1], out, 3, padding=1)

    def forward(self, raster: Float[Tensor, "b k x y"]) -> Float[Tensor, "b c h w"]:
        """The feature map; a SiLU follows every layer but the last, the average as well."""
        features = functional.silu(self.conv_in(raster))
        for block in self.blocks:
            features = functional.silu(block(features))
        return self.conv_out(features)
