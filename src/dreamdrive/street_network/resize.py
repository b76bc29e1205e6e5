"""Pictures resized to what the network takes, and its predictions back on their pixels."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
import torch
from jaxtyping import Float, Int, UInt8
from torch import Tensor
from torch.nn import functional

MULTIPLE_PX = 32
"""Sides of what the network takes are multiples of it."""
_ANSWER_PX, _FEATURE_PX = 4, 8
"""Pixels of the network's picture, along each side, that an answer and a feature cover at most."""


@dataclass(frozen=True)
class ResizePad:
    """From pictures to those that the network takes: scaled, and continued above and below.

    The scaled height is a whole number of the coarsest answers, so that each answer covers pixels of the
    picture alone or none; it is off by half an answer at most. So are the rows above it, of features too.

    Attributes:
        width_px: Width of the pictures.
        height_px: Their height.
        across_px: Width for the network.
        down_px: Height of the scaled picture.
        above_px: Rows above it.
        below_px: Rows below it.
    """

    width_px: int
    height_px: int
    across_px: int
    down_px: int
    above_px: int
    below_px: int

    @staticmethod
    def choose(width_px: int, height_px: int, across_px: int) -> "ResizePad":
        """How pictures of a size come to a width, a multiple of ``MULTIPLE_PX``."""
        if across_px < MULTIPLE_PX or across_px % MULTIPLE_PX:
            raise ValueError(f"look: width {across_px} px, expected a multiple of {MULTIPLE_PX}")
        down = _ANSWER_PX * max(1, round(across_px * height_px / width_px / _ANSWER_PX))
        more = -down % MULTIPLE_PX
        above = _FEATURE_PX * (more // _FEATURE_PX // 2)
        return ResizePad(width_px, height_px, across_px, down, above, more - above)

    @property
    def scale(self) -> float:
        """Pixels of the network's picture for one of the picture."""
        return self.across_px / self.width_px

    @property
    def shift_px(self) -> float:
        """How far the middle of the scaled picture lies above that of the network's."""
        return (self.below_px - self.above_px) / 2

    def taken(self, frames: UInt8[np.ndarray, "n h w 3"]) -> Float[Tensor, "n 3 h2 w2"]:
        """Pictures as the network takes them: in [0, 1], with the outermost rows continued."""
        rule = cv2.INTER_AREA if self.scale < 1 else cv2.INTER_LINEAR
        scaled = [cv2.resize(frame, (self.across_px, self.down_px), interpolation=rule) for frame in frames]
        pictures = torch.from_numpy(np.stack(scaled)).permute(0, 3, 1, 2).float() / 255
        return functional.pad(pictures, (0, 0, self.above_px, self.below_px), mode="replicate")

    def shown(self, answers: Float[Tensor, "*n h w"]) -> Float[Tensor, "*n h2 w"]:
        """The part of answers that lies on the picture; half of the last row of features may lie below it."""
        stride = self.across_px // answers.shape[-1]
        first = self.above_px // stride
        return answers[..., first : first - (-self.down_px // stride), :]

    def on_pixels(
        self, answers: Float[Tensor, "c h w"], mode: Literal["bilinear", "nearest-exact"] = "bilinear"
    ) -> Float[Tensor, "c h2 w2"]:
        """Answers on the pixels of the picture."""
        size = self.height_px, self.width_px
        return functional.interpolate(self.shown(answers)[None], size, mode=mode)[0]


def within_regions(
    values: Float[Tensor, "c h w"], weight: Float[Tensor, "h w"], region: Int[Tensor, "h2 w2"]
) -> Float[Tensor, "c h2 w2"]:
    """Coarse maps at the size of a map of regions: a pixel takes the mean of those neighbours in its region.

    The four nearest count, by their distance as in bilinear interpolation and by their weight. Where none
    lies in the pixel's region it takes the nearest: a pole may be thinner than the coarse map shows.
    """
    (high, wide), (height, width) = values.shape[1:], region.shape
    rows, columns = (_neighbours(*each) for each in ((high, height), (wide, width)))
    # A coarse value has the region of the pixel under its centre.
    under = [((torch.arange(n) + 0.5) * m / n).long() for n, m in ((high, height), (wide, width))]
    coarse = region[under[0][:, None], under[1]]
    among, nearest = torch.zeros(2, height, width)
    inside, outside = torch.zeros(2, len(values), height, width)
    for row, down in rows:
        for column, across in columns:
            at = row[:, None], column
            here, share = values[:, at[0], at[1]], down[:, None] * across
            same = share * weight[at] * (coarse[at] == region)
            among += same
            inside += same * here
            outside = torch.where(share > nearest, here, outside)
            nearest = torch.maximum(nearest, share)
    return torch.where(among > 0, inside / among.clamp(min=1e-20), outside)


def _neighbours(coarse: int, fine: int) -> list[tuple[Int[Tensor, " n"], Float[Tensor, " n"]]]:
    """The two nearest coarse places of each fine one along an axis, with their shares."""
    place = ((torch.arange(fine) + 0.5) * coarse / fine - 0.5).clamp(0, coarse - 1)
    first = place.long().clamp(max=max(coarse - 2, 0))
    second = (first + 1).clamp(max=coarse - 1)
    share = place - first
    return [(first, 1 - share), (second, share)]
