"""LPIPS v0.1 (Zhang et al. 2018): weighted distances between layers of VGG16 or AlexNet."""

from collections.abc import Callable
from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.errors import InputError
from dreamdrive.models import fill_network, read_state

TRUNK_FILE = "the weights of torchvision's VGG16 (vgg16-397923af.pth) or AlexNet (alexnet-owt-7be5be79.pth)"
HEADS_FILE = (
    "the LPIPS v0.1 heads of the same network (weights/v0.1/vgg.pth or alex.pth of the package lpips)"
)
_SHIFT = (-0.030, -0.088, -0.188)
_SCALE = (0.458, 0.448, 0.450)
_EPS = 1e-10
_PAIRS = 1


class Trunk(nn.Module):
    """Layers in sequence; behind those whose indices are ``taps``, values are taken."""

    def __init__(self, layers: list[nn.Module], taps: tuple[int, ...]) -> None:
        super().__init__()
        self.features = nn.Sequential(*layers[: taps[-1] + 1])
        self.taps = taps

    def forward(self, images: Float[Tensor, "n 3 h w"]) -> list[Tensor]:
        """Values at the taps, of images in [-1, 1]."""
        shift, scale = (images.new_tensor(values)[:, None, None] for values in (_SHIFT, _SCALE))
        x, values = (images - shift) / scale, list[Tensor]()
        for index, layer in enumerate(self.features):
            x = layer(x)
            if index in self.taps:
                values.append(x)
        return values


class Heads(nn.Module):
    """One non-negative weight for each channel of each tap."""

    def __init__(self, channels: tuple[int, ...]) -> None:
        super().__init__()
        for tap, count in enumerate(channels):
            # The official keys count a dropout in front, which has no weights.
            head = nn.Sequential(nn.Identity(), nn.Conv2d(count, 1, 1, bias=False))
            self.add_module(f"lin{tap}", nn.ModuleDict({"model": head}))

    def forward(self, differences: list[Tensor]) -> Float[Tensor, " n"]:
        """Sum over the taps of the weighted squared differences, averaged over pixels."""
        terms = [
            layer["model"](values).mean(dim=(1, 2, 3))  # pyright: ignore[reportIndexIssue]
            for layer, values in zip(self.children(), differences, strict=True)
        ]
        return torch.stack(terms).sum(dim=0)


class PerceptualDistance:
    """A trunk and heads of a kind, ``vgg`` or ``alex``; ``trunk`` gives the values behind them."""

    def __init__(self, kind: str, trunk: Trunk, heads: Heads) -> None:
        self.kind = kind
        self.trunk = trunk
        self._heads = heads

    def __call__(self, a: Float[Tensor, "n 3 h w"], b: Float[Tensor, "n 3 h w"]) -> Float[Tensor, " n"]:
        """Distance of each pair of images.

        Values in [-1, 1] are the definition; 3DGS and its relatives hand in [0, 1] and get lower values.
        """
        with torch.inference_mode():
            parts = [self.of(p, q) for p, q in zip(a.split(_PAIRS), b.split(_PAIRS), strict=True)]
        return torch.cat(parts)

    def to(self, device: torch.device) -> "PerceptualDistance":
        """The same on a device, its weights fixed."""
        for network in (self.trunk, self._heads):
            network.to(device).requires_grad_(False)
        return self

    def of(self, a: Float[Tensor, "n 3 h w"], b: Float[Tensor, "n 3 h w"]) -> Float[Tensor, " n"]:
        """The same all at once, with gradients where the images have them."""
        return self._heads([_difference(x, y) for x, y in zip(self.trunk(a), self.trunk(b), strict=True)])


def _difference(x: Tensor, y: Tensor) -> Tensor:
    """Squared difference of values scaled to unit length over the channels."""
    # Where all channels are 0 the root has no gradient.
    x, y = (v / (v.square().sum(dim=1, keepdim=True).clamp(min=_EPS**2).sqrt() + _EPS) for v in (x, y))
    return (x - y).square()


CHANNELS = {"vgg": (64, 128, 256, 512, 512), "alex": (64, 192, 384, 256, 256)}
"""Channels at the taps."""


def vgg(
    pooling: Callable[[int], list[nn.Module]] = lambda channels: [nn.MaxPool2d(2, 2)],
    taps: tuple[int, ...] = (3, 8, 15, 22, 29),
) -> Trunk:
    """VGG16, tapped after the last ReLU before each pooling, of so many channels, and at the end."""
    layers: list[nn.Module] = []
    channels = 3
    for stage, (out, convolutions) in enumerate(((64, 2), (128, 2), (256, 3), (512, 3), (512, 3))):
        if stage:
            layers += pooling(channels)
        for _ in range(convolutions):
            layers += [nn.Conv2d(channels, out, 3, padding=1), nn.ReLU()]
            channels = out
    return Trunk(layers, taps)


def alex() -> Trunk:
    """AlexNet, tapped after each ReLU."""
    layers: list[nn.Module] = [nn.Conv2d(3, 64, 11, 4, 2), nn.ReLU(), nn.MaxPool2d(3, 2)]
    layers += [nn.Conv2d(64, 192, 5, padding=2), nn.ReLU(), nn.MaxPool2d(3, 2)]
    for channels, out in ((192, 384), (384, 256), (256, 256)):
        layers += [nn.Conv2d(channels, out, 3, padding=1), nn.ReLU()]
    return Trunk(layers, (1, 4, 7, 9, 11))


TRUNKS = {"vgg": vgg, "alex": alex}


def load_lpips(trunk: Path, heads: Path) -> PerceptualDistance:
    """LPIPS with the weights of two files; which network it is follows from the trunk."""
    state = {k: v for k, v in read_state(trunk, TRUNK_FILE).items() if not k.startswith("classifier.")}
    first = state.get("features.0.weight")
    kind = {3: "vgg", 11: "alex"}.get(0 if first is None else first.shape[-1])
    if kind is None:
        raise InputError(f"{trunk} holds neither network; expected {TRUNK_FILE}")
    filled = fill_network(TRUNKS[kind], state, str(trunk), TRUNK_FILE)
    head_state = {k: v for k, v in read_state(heads, HEADS_FILE).items() if not k.startswith("lins.")}
    expected = f"{HEADS_FILE}, here those of {kind}"
    return PerceptualDistance(
        kind, filled, fill_network(lambda: Heads(CHANNELS[kind]), head_state, str(heads), expected)
    )
