"""The decoder: from features at strides of 2 to 32 pixels to maps at strides of 2 and 4, and the camera."""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from dreamdrive.street_network.encoder import CHANNELS, ConvNorm

WIDE, MIDDLE, NARROW, FINE = 128, 96, 64, 32
"""Channels at strides 16 and 32, at 8, at 4 and at 2."""


class Context(nn.Module):
    """What all of the picture, its rows and its columns tell each place, at stride 32 (strip pooling)."""

    def __init__(self) -> None:
        super().__init__()
        self.enter = ConvNorm(CHANNELS[-1], WIDE, 1)
        self.row = nn.Conv2d(WIDE, WIDE, 1)
        self.column = nn.Conv2d(WIDE, WIDE, 1)
        self.whole = nn.Conv2d(WIDE, WIDE, 1)
        self.place = nn.Conv2d(2, WIDE, 1)
        self.leave = ConvNorm(WIDE, WIDE, 3)

    def forward(self, x: Float[Tensor, "n c h w"]) -> Tensor:
        """Apply to the encoder's last features."""
        x = self.enter(x)
        rows, columns = x.mean(dim=3, keepdim=True), x.mean(dim=2, keepdim=True)
        whole = rows.mean(dim=2, keepdim=True)
        told = self.row(rows) + self.column(columns) + self.whole(whole) + self.place(places(x))
        return self.leave(functional.relu6(x + told))


class Fuse(nn.Module):
    """Coarse features, brought to the size of fine ones, with these."""

    def __init__(self, coarse: int, fine: int, out: int) -> None:
        super().__init__()
        self.mix = ConvNorm(coarse + fine, out, 3)

    def forward(self, coarse: Tensor, fine: Tensor) -> Tensor:
        """Apply to (n, c, h, w) and (n, c2, 2 h, 2 w)."""
        larger = functional.interpolate(coarse, scale_factor=2.0, mode="bilinear", align_corners=False)
        return self.mix(torch.cat([larger, fine], dim=1))


class CameraVotes(nn.Module):
    """The camera by votes of all places.

    Each tells how far above or below itself the horizon crosses its column, so that a line through the votes
    has the height and the roll; a tilt that a place sees itself is added.
    """

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.enter = ConvNorm(channels, FINE * 2, 3)
        self.votes = nn.Conv2d(FINE * 2, 10, 1)
        # Where weights follow anyway torch would load its compiler for this, which takes 1.5 s.
        if not self.votes.weight.is_meta:
            nn.init.normal_(self.votes.weight, std=1e-3)

    def forward(self, x: Float[Tensor, "n c h w"]) -> Float[Tensor, "n 7"]:
        """Means, logarithms of standard deviations and a logit, see ``Prediction.camera``."""
        said = self.votes(self.enter(x)).float()
        value, trust, spread, distorted = said.flatten(2).split([3, 3, 3, 1], dim=1)
        across, down = places(x).float().flatten(2).unbind(dim=1)
        share = trust.softmax(dim=2)
        mean, spread = (share * value).sum(dim=2), (share * spread).sum(dim=2)
        horizon, tilt = line_through(across, down + value[:, 1], share[:, 1])
        mean = torch.stack([mean[:, 0], horizon, mean[:, 2] - tilt], dim=1)
        # A start near what cameras are: 60 degrees across, level, known to 0.3, 0.1 and 0.05.
        start = said.new_tensor([-0.15, 0.0, 0.0]), said.new_tensor([-1.2, -2.3, -3.0])
        spread = start[1] + 4 * torch.tanh(spread / 4)
        return torch.cat([start[0] + mean, spread, distorted.mean(dim=2)], dim=1)


class Decoder(nn.Module):
    """Maps of what a picture shows, from its features at all strides."""

    def __init__(self) -> None:
        super().__init__()
        two, four, eight, sixteen, _ = CHANNELS
        self.context = Context()
        self.sixteen = Fuse(WIDE, sixteen, WIDE)
        self.eight = Fuse(WIDE, eight, MIDDLE)
        self.four = nn.ModuleList([Fuse(MIDDLE, four, NARROW), ConvNorm(NARROW, NARROW, 3)])
        self.narrow = ConvNorm(NARROW, FINE, 1)
        self.two = Fuse(FINE, two, FINE)
        self.maps = nn.Conv2d(FINE, 13, 1)
        self.users = nn.Sequential(ConvNorm(NARROW, FINE, 3), centres := nn.Conv2d(FINE, 5, 1))
        self.camera = CameraVotes(WIDE)
        with torch.no_grad():
            assert self.maps.bias is not None
            assert centres.bias is not None
            self.maps.bias[:2] = torch.tensor([2.3, -1.0])  # about ten camera heights away
            centres.bias[:3] = -3.0  # centres are rare

    def forward(self, features: list[Tensor]) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Maps (n, 13, ...), road users (n, 5, ...), camera (n, 7) and features at stride 8."""
        two, four, eight, sixteen, last = features
        x = self.sixteen(self.context(last), sixteen)
        camera = self.camera(x)
        kept = self.eight(x, eight)
        x = self.four[1](self.four[0](kept, four))
        return self.maps(self.two(self.narrow(x), two)), self.users(x), camera, kept


def line_through(
    across: Float[Tensor, "n k"], down: Float[Tensor, "n k"], share: Float[Tensor, "n k"]
) -> tuple[Float[Tensor, " n"], Float[Tensor, " n"]]:
    """Height in the middle column and slope of the line through weighted places; shares sum to 1."""
    x, y = ((share * each).sum(dim=1, keepdim=True) for each in (across, down))
    spread = (share * (across - x) ** 2).sum(dim=1) + 1e-3
    slope = (share * (across - x) * (down - y)).sum(dim=1) / spread
    return y[:, 0] - slope * x[:, 0], slope


def places(x: Float[Tensor, "n c h w"]) -> Float[Tensor, "n 2 h w"]:
    """Columns and rows of the places of a map, from the middle, in widths."""
    height, width = x.shape[-2:]
    down = (torch.arange(height, device=x.device) + 0.5 - height / 2) / width
    across = (torch.arange(width, device=x.device) + 0.5) / width - 0.5
    grid = torch.stack(torch.meshgrid(across, down, indexing="xy"))
    return grid.to(x.dtype).expand(len(x), -1, -1, -1)
