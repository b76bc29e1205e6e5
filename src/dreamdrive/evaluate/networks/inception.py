"""Inception-v3 as FID uses it: the TensorFlow graph of 2015-12-05, with the keys of its PyTorch port.

It differs from the classifier of the same name in torchvision: average pools do not count their padding, the
last block pools by maximum, and there is no auxiliary head (Szegedy et al. 2016; Heusel et al. 2017).
"""

from pathlib import Path

import torch
from jaxtyping import Float, UInt8
from torch import Tensor, nn
from torch.nn import functional

from dreamdrive.evaluate.networks.resize import resize
from dreamdrive.models import load_network
from dreamdrive.names import Resize

FILE = "pt_inception-2015-12-05-6726825d.pth (also named weights-inception-2015-12-05-6726825d.pth)"
SIZE_PX = 299
_BATCH = 16


class _ConvNorm(nn.Module):
    """Convolution, batch norm, ReLU."""

    def __init__(
        self, channels: int, out: int, kernel: int | tuple[int, int], stride: int = 1, padding: bool = True
    ) -> None:
        super().__init__()
        sides = (kernel, kernel) if isinstance(kernel, int) else kernel
        pads = (sides[0] // 2, sides[1] // 2) if padding else (0, 0)
        self.conv = nn.Conv2d(channels, out, sides, stride, pads, bias=False)
        self.bn = nn.BatchNorm2d(out, eps=1e-3)

    def forward(self, x: Tensor) -> Tensor:
        """Apply to (n, channels, h, w)."""
        return functional.relu(self.bn(self.conv(x)))


class _Block(nn.Module):
    """Convolutions behind and beside each other.

    Rows are the name of a convolution, what it takes (``x`` is the input, ``pool`` the pooled one), its
    channels and its kernel; ``ends`` are put side by side. A block that halves does so at its ends, without
    padding; any other pools over the neighbours, by their mean or their maximum.
    """

    def __init__(
        self,
        channels: int,
        ends: tuple[str, ...],
        rows: tuple[tuple[str, str, int, int | tuple[int, int]], ...],
        *,
        halves: bool = False,
        pool_maximum: bool = False,
    ) -> None:
        super().__init__()
        self._ends, self._halves, self._pool_maximum = ends, halves, pool_maximum
        self._sources = [source for _, source, *_ in rows]
        widths = {"x": channels, "pool": channels}
        for name, source, out, kernel in rows:
            widths[name], end = out, halves and name in ends
            layer = _ConvNorm(widths[source], out, kernel, 2 if end else 1, padding=not end)
            self.add_module(f"branch{name}", layer)

    def forward(self, x: Tensor) -> Tensor:
        """Apply to (n, channels, h, w)."""
        values = {"x": x, "pool": self._pooled(x)}
        for (name, layer), source in zip(self.named_children(), self._sources, strict=True):
            values[name.removeprefix("branch")] = layer(values[source])
        return torch.cat([values[end] for end in self._ends], 1)

    def _pooled(self, x: Tensor) -> Tensor:
        if self._halves:
            return functional.max_pool2d(x, 3, 2)
        if self._pool_maximum:
            return functional.max_pool2d(x, 3, 1, 1)
        return functional.avg_pool2d(x, 3, 1, 1, count_include_pad=False)


def _block_a(channels: int, pooled: int) -> _Block:
    """35 x 35: 1x1, 5x5, double 3x3 and pool branches."""
    rows = (
        ("1x1", "x", 64, 1),
        ("5x5_1", "x", 48, 1),
        ("5x5_2", "5x5_1", 64, 5),
        ("3x3dbl_1", "x", 64, 1),
        ("3x3dbl_2", "3x3dbl_1", 96, 3),
        ("3x3dbl_3", "3x3dbl_2", 96, 3),
        ("_pool", "pool", pooled, 1),
    )
    return _Block(channels, ("1x1", "5x5_2", "3x3dbl_3", "_pool"), rows)


def _block_b() -> _Block:
    """35 x 35 to 17 x 17."""
    rows = (
        ("3x3", "x", 384, 3),
        ("3x3dbl_1", "x", 64, 1),
        ("3x3dbl_2", "3x3dbl_1", 96, 3),
        ("3x3dbl_3", "3x3dbl_2", 96, 3),
    )
    return _Block(288, ("3x3", "3x3dbl_3", "pool"), rows, halves=True)


def _block_c(inner: int) -> _Block:
    """17 x 17: 1x1, 7x7, double 7x7 and pool branches."""
    rows = (
        ("1x1", "x", 192, 1),
        ("7x7_1", "x", inner, 1),
        ("7x7_2", "7x7_1", inner, (1, 7)),
        ("7x7_3", "7x7_2", 192, (7, 1)),
        ("7x7dbl_1", "x", inner, 1),
        ("7x7dbl_2", "7x7dbl_1", inner, (7, 1)),
        ("7x7dbl_3", "7x7dbl_2", inner, (1, 7)),
        ("7x7dbl_4", "7x7dbl_3", inner, (7, 1)),
        ("7x7dbl_5", "7x7dbl_4", 192, (1, 7)),
        ("_pool", "pool", 192, 1),
    )
    return _Block(768, ("1x1", "7x7_3", "7x7dbl_5", "_pool"), rows)


def _block_d() -> _Block:
    """17 x 17 to 8 x 8."""
    rows = (
        ("3x3_1", "x", 192, 1),
        ("3x3_2", "3x3_1", 320, 3),
        ("7x7x3_1", "x", 192, 1),
        ("7x7x3_2", "7x7x3_1", 192, (1, 7)),
        ("7x7x3_3", "7x7x3_2", 192, (7, 1)),
        ("7x7x3_4", "7x7x3_3", 192, 3),
    )
    return _Block(768, ("3x3_2", "7x7x3_4", "pool"), rows, halves=True)


def _block_e(channels: int, *, pool_maximum: bool) -> _Block:
    """8 x 8: branches that fork at their ends."""
    rows = (
        ("1x1", "x", 320, 1),
        ("3x3_1", "x", 384, 1),
        ("3x3_2a", "3x3_1", 384, (1, 3)),
        ("3x3_2b", "3x3_1", 384, (3, 1)),
        ("3x3dbl_1", "x", 448, 1),
        ("3x3dbl_2", "3x3dbl_1", 384, 3),
        ("3x3dbl_3a", "3x3dbl_2", 384, (1, 3)),
        ("3x3dbl_3b", "3x3dbl_2", 384, (3, 1)),
        ("_pool", "pool", 192, 1),
    )
    ends = ("1x1", "3x3_2a", "3x3_2b", "3x3dbl_3a", "3x3dbl_3b", "_pool")
    return _Block(channels, ends, rows, pool_maximum=pool_maximum)


class Inception(nn.Module):
    """From (n, 3, 299, 299) with values in [-1, 1] to the mean of the last block (n, 2048)."""

    def __init__(self) -> None:
        super().__init__()
        self.Conv2d_1a_3x3 = _ConvNorm(3, 32, 3, 2, padding=False)
        self.Conv2d_2a_3x3 = _ConvNorm(32, 32, 3, padding=False)
        self.Conv2d_2b_3x3 = _ConvNorm(32, 64, 3)
        self.Conv2d_3b_1x1 = _ConvNorm(64, 80, 1)
        self.Conv2d_4a_3x3 = _ConvNorm(80, 192, 3, padding=False)
        self.Mixed_5b = _block_a(192, 32)
        self.Mixed_5c = _block_a(256, 64)
        self.Mixed_5d = _block_a(288, 64)
        self.Mixed_6a = _block_b()
        self.Mixed_6b = _block_c(128)
        self.Mixed_6c = _block_c(160)
        self.Mixed_6d = _block_c(160)
        self.Mixed_6e = _block_c(192)
        self.Mixed_7a = _block_d()
        self.Mixed_7b = _block_e(1280, pool_maximum=False)
        self.Mixed_7c = _block_e(2048, pool_maximum=True)

    def forward(self, x: Float[Tensor, "n 3 299 299"]) -> Float[Tensor, "n 2048"]:
        """Features of prepared images."""
        x = self.Conv2d_2b_3x3(self.Conv2d_2a_3x3(self.Conv2d_1a_3x3(x)))
        x = self.Conv2d_4a_3x3(self.Conv2d_3b_1x1(functional.max_pool2d(x, 3, 2)))
        x = self.Mixed_5d(self.Mixed_5c(self.Mixed_5b(functional.max_pool2d(x, 3, 2))))
        x = self.Mixed_6c(self.Mixed_6b(self.Mixed_6a(x)))
        x = self.Mixed_7a(self.Mixed_6e(self.Mixed_6d(x)))
        return self.Mixed_7c(self.Mixed_7b(x)).mean(dim=(2, 3))


def load_inception(path: Path) -> Inception:
    """The network with the weights of a file; its classifier is not used."""
    return load_network(Inception, path, FILE, ignored=("fc.",))


def inception_features(
    network: Inception, frames: UInt8[Tensor, "n h w 3"], method: Resize = "tf1"
) -> Float[Tensor, "n 2048"]:
    """Features for FID of RGB images, brought to 299 x 299; of the aspect ratio nothing is kept.

    Values become (x - 128) / 128, with ``torch`` (x - 127.5) / 127.5 as in pytorch-fid.
    """
    middle = 127.5 if method == "torch" else 128.0
    with torch.inference_mode():
        pictures = (resize(batch, SIZE_PX, SIZE_PX, method) for batch in frames.split(_BATCH))
        return torch.cat([network((picture - middle) / middle) for picture in pictures])
