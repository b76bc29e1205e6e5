"""Inflated 3-D Inception for FVD: RGB, Kinetics-400, with the keys of its PyTorch port (Carreira 2017)."""

from collections import OrderedDict
from pathlib import Path

import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn
from torch.nn import functional

from dreamdrive.errors import InputError
from dreamdrive.evaluate.networks.resize import pad_same, resize
from dreamdrive.models import load_network

FILE = "i3d_pretrained_400.pt, the state dict (not the TorchScript archive)"
SIZE_PX = 224
MIN_FRAMES = 9
"""Below this the last pool, of two time steps, has but one to pool: time is divided by 8."""

Triple = tuple[int, int, int]


class ConvNorm3d(nn.Module):
    """Convolution with TensorFlow's padding, batch norm, ReLU."""

    def __init__(self, channels: int, out: int, kernel: int, stride: int = 1) -> None:
        super().__init__()
        self.conv3d = nn.Conv3d(channels, out, kernel, stride, bias=False)
        self.bn = nn.BatchNorm3d(out, eps=1e-5)
        self._window = (kernel, kernel, kernel), (stride, stride, stride)

    def forward(self, x: Tensor) -> Tensor:
        """Apply to (n, channels, t, h, w)."""
        return functional.relu(self.bn(self.conv3d(pad_same(x, *self._window))))


class Mixed(nn.Module):
    """1x1x1, two 3x3x3 and pool branches."""

    def __init__(self, channels: int, out: tuple[int, int, int, int, int, int]) -> None:
        super().__init__()
        self.b0 = ConvNorm3d(channels, out[0], 1)
        self.b1a = ConvNorm3d(channels, out[1], 1)
        self.b1b = ConvNorm3d(out[1], out[2], 3)
        self.b2a = ConvNorm3d(channels, out[3], 1)
        self.b2b = ConvNorm3d(out[3], out[4], 3)
        self.b3b = ConvNorm3d(channels, out[5], 1)

    def forward(self, x: Tensor) -> Tensor:
        """Apply to (n, channels, t, h, w)."""
        pooled = _max_pool(x, (3, 3, 3), (1, 1, 1))
        return torch.cat([self.b0(x), self.b1b(self.b1a(x)), self.b2b(self.b2a(x)), self.b3b(pooled)], 1)


def _max_pool(x: Tensor, kernel: Triple, stride: Triple) -> Tensor:
    # All values are behind a ReLU: zeros of the padding never win.
    return functional.max_pool3d(pad_same(x, kernel, stride), kernel, stride)


class I3d(nn.Module):
    """From (n, 3, t, 224, 224) with values in [-1, 1] and t >= 9 to 400 logits."""

    def __init__(self) -> None:
        super().__init__()
        self.Conv3d_1a_7x7 = ConvNorm3d(3, 64, 7, 2)
        self.Conv3d_2b_1x1 = ConvNorm3d(64, 64, 1)
        self.Conv3d_2c_3x3 = ConvNorm3d(64, 192, 3)
        self.Mixed_3b = Mixed(192, (64, 96, 128, 16, 32, 32))
        self.Mixed_3c = Mixed(256, (128, 128, 192, 32, 96, 64))
        self.Mixed_4b = Mixed(480, (192, 96, 208, 16, 48, 64))
        self.Mixed_4c = Mixed(512, (160, 112, 224, 24, 64, 64))
        self.Mixed_4d = Mixed(512, (128, 128, 256, 24, 64, 64))
        self.Mixed_4e = Mixed(512, (112, 144, 288, 32, 64, 64))
        self.Mixed_4f = Mixed(528, (256, 160, 320, 32, 128, 128))
        self.Mixed_5b = Mixed(832, (256, 160, 320, 32, 128, 128))
        self.Mixed_5c = Mixed(832, (384, 192, 384, 48, 128, 128))
        self.logits = nn.Sequential(OrderedDict(conv3d=nn.Conv3d(1024, 400, 1)))

    def forward(self, x: Float[Tensor, "n 3 t 224 224"]) -> Float[Tensor, "n 400"]:
        """Logits of prepared clips, averaged over the time steps that are left."""
        flat: tuple[Triple, Triple] = ((1, 3, 3), (1, 2, 2))
        x = _max_pool(self.Conv3d_1a_7x7(x), *flat)
        x = _max_pool(self.Conv3d_2c_3x3(self.Conv3d_2b_1x1(x)), *flat)
        x = _max_pool(self.Mixed_3c(self.Mixed_3b(x)), (3, 3, 3), (2, 2, 2))
        x = self.Mixed_4f(self.Mixed_4e(self.Mixed_4d(self.Mixed_4c(self.Mixed_4b(x)))))
        x = self.Mixed_5c(self.Mixed_5b(_max_pool(x, (2, 2, 2), (2, 2, 2))))
        x = self.logits(functional.avg_pool3d(x, (2, 7, 7), 1))
        return x.mean(dim=(2, 3, 4))


def load_i3d(path: Path) -> I3d:
    """The network with the weights of a file."""
    return load_network(I3d, path, FILE)


def prepare(frames: UInt8[Tensor, "t h w 3"]) -> Float[Tensor, "1 3 t 224 224"]:
    """Frames as the network takes them: plain bilinear to 224 x 224, values in [-1, 1]."""
    values = 2 * resize(frames, SIZE_PX, SIZE_PX, "torch") / 255 - 1
    return values.permute(1, 0, 2, 3)[None]


def i3d_features(network: I3d, frames: UInt8[Tensor, "t h w 3"]) -> Float[Tensor, " 400"]:
    """Features for FVD of one clip of RGB frames: the logits."""
    if len(frames) < MIN_FRAMES:
        raise InputError(
            f"FVD needs clips of {MIN_FRAMES} frames or more, got {len(frames)}; use longer ones"
        )
    with torch.inference_mode():
        return network(prepare(frames))[0]
