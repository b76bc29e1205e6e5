"""Shift-tolerant LPIPS (Ghildyal and Liu 2022): strides are replaced by blurred subsampling."""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from dreamdrive.errors import installing
from dreamdrive.evaluate.networks import lpips
from dreamdrive.evaluate.networks.lpips import CHANNELS, Heads, PerceptualDistance, Trunk
from dreamdrive.evaluate.networks.packaged import PackagedFile
from dreamdrive.models import fill_network, read_state

_SHA256 = {
    "alex": "b356b382f96010f77d085ee8343ecd9fd322d0a56e8de2b2d0549fafcad8b9ee",
    "vgg": "44597da68f49c1837c100ff52299050f274d102eb102e5837178c79be6f0e250",
}
FILES = {
    kind: PackagedFile(
        "stlpips-pytorch",
        f"stlpips_pytorch/weights/vST0.0/{kind}_shift_tolerant.pth",
        digest,
        installing("metrics"),
    )
    for kind, digest in _SHA256.items()
}


class BlurPool(nn.Module):
    """Every second pixel of the blurred image, with two pixels reflected around it.

    The kernel, (1, 2, 1) / 4 along both axes, is part of the weights.
    """

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.register_buffer("filt", torch.empty(channels, 1, 3, 3))

    def forward(self, x: Float[Tensor, "n c h w"]) -> Float[Tensor, "n c h2 w2"]:
        """Halve both sides, roughly."""
        wide = functional.pad(x, [2] * 4, mode="reflect")
        return functional.conv2d(wide, self.get_buffer("filt"), stride=2, groups=x.shape[1])


def vgg() -> Trunk:
    """VGG16 whose pools have stride 1 and a blurred subsampling behind."""
    return lpips.vgg(lambda channels: [nn.MaxPool2d(2, 1), BlurPool(channels)], (3, 9, 17, 25, 33))


def alex() -> Trunk:
    """AlexNet without strides; the first convolution's 4 becomes 2 by blurred subsampling."""
    layers: list[nn.Module] = [nn.Conv2d(3, 64, 11, padding=2), BlurPool(64), nn.ReLU()]
    layers += [nn.MaxPool2d(3, 1), BlurPool(64), nn.Conv2d(64, 192, 5, padding=2), nn.ReLU()]
    layers += [nn.MaxPool2d(3, 1), BlurPool(192)]
    for channels, out in ((192, 384), (384, 256), (256, 256)):
        layers += [nn.Conv2d(channels, out, 3, padding=1), nn.ReLU()]
    return Trunk(layers, (2, 6, 10, 12, 14))


TRUNKS = {"alex": alex, "vgg": vgg}


def load_stlpips(kind: str) -> PerceptualDistance:
    """``alex`` or ``vgg`` with the weights of the installed package; it takes images in [-1, 1]."""
    path = FILES[kind].locate()
    trunk: dict[str, Tensor] = {}
    heads: dict[str, Tensor] = {}
    for key, value in read_state(path, FILES[kind].path).items():
        if key.startswith("net."):
            trunk["features." + key.split(".", 2)[2]] = value
        elif key.startswith("lin"):
            heads[key] = value
    return PerceptualDistance(
        kind,
        fill_network(TRUNKS[kind], trunk, str(path), FILES[kind].path),
        fill_network(lambda: Heads(CHANNELS[kind]), heads, str(path), FILES[kind].path),
    )
