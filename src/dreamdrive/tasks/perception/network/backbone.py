"""The front end of EfficientNet-B4 (Tan and Le 2019): features at strides of 4 and 16 pixels.

Names of the parts, so the keys of weights, are those of the package ``efficientnet_pytorch``, from which the
published network took them; evaluation of Cross-View Transformers cuts it behind its block 10.
"""

from itertools import pairwise
from math import ceil

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

_STAGES = ((3, 1, 1, 24, 2), (3, 2, 6, 32, 4), (5, 2, 6, 56, 4), (3, 2, 6, 112, 1))
"""Kernel, stride, widening, channels and repetitions; of the last stage's six blocks only one is used."""
_STEM = 48
PART_STARTS = (0, 3, 7, 11)
"""First blocks of the three parts of which the keys speak, and the end of the last."""
_NOMINAL_PX = 380
"""Side of the pictures for which B4 pads. The original keeps that padding at all sizes."""
_DROP, _ALL_BLOCKS = 0.2, 32
_EPSILON, _MOMENTUM = 1e-3, 0.01


class FilterConv(nn.Conv2d):
    """A convolution that bfloat16 by autocast does not slow down on the CPU.

    There the gradient of large or strided filters of single channels takes three to ten times as long as in
    float32, in which they therefore stay.
    """

    def forward(self, input: Tensor) -> Tensor:
        """Apply to (n, channels, h, w)."""
        slow = self.groups > 1 and (self.stride[0] > 1 or self.kernel_size[0] > 3)
        if not (slow and input.is_cpu and torch.is_autocast_enabled("cpu")):
            return super().forward(input)
        with torch.autocast("cpu", enabled=False):
            return super().forward(input.float()).to(torch.get_autocast_dtype("cpu"))


class PaddedConv(FilterConv):
    """A convolution whose padding is that of TensorFlow's "same" at one size of the input, at all sizes."""

    def __init__(
        self, channels: int, out: int, kernel: int, stride: int, side_px: int, groups: int = 1
    ) -> None:
        super().__init__(channels, out, kernel, stride, groups=groups, bias=False)
        total = max((ceil(side_px / stride) - 1) * stride + kernel - side_px, 0)
        self._before, self._after = total // 2, total - total // 2
        if self._before == self._after:
            self.padding = (self._before, self._before)

    @property
    def pads(self) -> tuple[int, int, int, int]:
        """Left, right, top and bottom."""
        return self._before, self._after, self._before, self._after

    def forward(self, input: Tensor) -> Tensor:
        """Apply to (n, channels, h, w)."""
        return super().forward(input if self._before == self._after else functional.pad(input, self.pads))


class MbConv(nn.Module):
    """Inverted bottleneck: widen, filter each channel, weigh channels, narrow; added to what keeps its shape.

    Args:
        channels: Of the input.
        out: Of the output.
        kernel: Side of the filters.
        stride: Of the filters.
        widening: Channels in the middle as a multiple of those of the input.
        side_px: Side of the input for which the padding is right.
        drop: Share of samples whose sum keeps the input alone, in training.
    """

    def __init__(
        self, channels: int, out: int, kernel: int, stride: int, widening: int, side_px: int, drop: float
    ) -> None:
        super().__init__()
        wide, squeezed = channels * widening, max(1, channels // 4)
        self._widens = widening != 1
        if self._widens:
            self._expand_conv = nn.Conv2d(channels, wide, 1, bias=False)
            self._bn0 = _norm(wide)
        self._depthwise_conv = PaddedConv(wide, wide, kernel, stride, side_px, groups=wide)
        self._bn1 = _norm(wide)
        self._se_reduce = nn.Conv2d(wide, squeezed, 1)
        self._se_expand = nn.Conv2d(squeezed, wide, 1)
        self._project_conv = nn.Conv2d(wide, out, 1, bias=False)
        self._bn2 = _norm(out)
        self._keeps_shape = stride == 1 and channels == out
        self._drop = drop
        self.draws: torch.Generator | None = None
        """From which is drawn what is dropped, on its device; None for torch's own of the pictures'."""

    def forward(self, x: Tensor) -> Tensor:
        """Apply to (n, channels, h, w)."""
        wide = functional.silu(self._bn0(self._expand_conv(x))) if self._widens else x
        wide = functional.silu(self._bn1(self._depthwise_conv(wide)))
        means = wide.mean(dim=(2, 3), keepdim=True)
        wide = wide * torch.sigmoid(self._se_expand(functional.silu(self._se_reduce(means))))
        narrow = self._bn2(self._project_conv(wide))
        if not self._keeps_shape:
            return narrow
        return x + (_drop_samples(narrow, self._drop, self.draws) if self.training and self._drop else narrow)


class EfficientNetFront(nn.Module):
    """EfficientNet-B4 up to block 10.

    Args:
        width: Channels as a share of B4's, brought to multiples of 8; 1 is B4.

    Attributes:
        channels: Of the two maps of features; (32, 112) for B4.
    """

    def __init__(self, width: float = 1.0) -> None:
        super().__init__()
        channels, side_px = _scaled(_STEM, width), _NOMINAL_PX
        stem = PaddedConv(3, channels, 3, 2, side_px)
        side_px = ceil(side_px / 2)
        blocks: list[MbConv] = []
        for kernel, first, widening, out, repetitions in _STAGES:
            for repetition in range(repetitions):
                stride, drop = (1 if repetition else first), _DROP * len(blocks) / _ALL_BLOCKS
                wide = _scaled(out, width)
                blocks.append(MbConv(channels, wide, kernel, stride, widening, side_px, drop))
                channels, side_px = wide, ceil(side_px / stride)
        parts = [nn.Sequential(*blocks[start:end]) for start, end in pairwise(PART_STARTS)]
        first_part = nn.Sequential(stem, _norm(stem.out_channels), nn.SiLU())
        self.layers = nn.ModuleList([first_part, *parts])
        self.channels = _scaled(_STAGES[1][3], width), _scaled(_STAGES[3][3], width)

    def forward(self, pictures: Float[Tensor, "n 3 h w"]) -> list[Tensor]:
        """Features at strides of 4 and 16 of pictures that are normalised as for ImageNet."""
        x = pictures.contiguous(memory_format=torch.channels_last)
        fine = self.layers[1](self.layers[0](x))
        return [fine, self.layers[3](self.layers[2](fine))]

    def draw_from(self, draws: torch.Generator | None) -> None:
        """Draw what is dropped in training from a generator of the CPU; None for torch's own."""
        for module in self.modules():
            if isinstance(module, MbConv):
                module.draws = draws


def _norm(channels: int) -> nn.BatchNorm2d:
    return nn.BatchNorm2d(channels, eps=_EPSILON, momentum=_MOMENTUM)


def _scaled(channels: int, width: float) -> int:
    return channels if width == 1 else max(8, round(channels * width / 8) * 8)


def _drop_samples(
    x: Float[Tensor, "n c h w"], share: float, draws: torch.Generator | None
) -> Float[Tensor, "n c h w"]:
    """Zero for a share of the samples; the others grow by as much."""
    device = x.device if draws is None else draws.device
    kept = torch.rand(len(x), 1, 1, 1, generator=draws, device=device) >= share
    return x * (kept / (1 - share)).to(x)
