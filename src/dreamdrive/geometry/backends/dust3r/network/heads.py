"""Heads that make points and confidences of tokens: linear, DPT (Ranftl et al. 2021)."""

from dataclasses import dataclass

from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from dreamdrive.geometry.backends.dust3r.network.config import ConfidenceMode, DepthMode, NetworkConfig

_CHANNELS = 4  # x, y, z and confidence


@dataclass(frozen=True)
class Pointmap:
    """Points in the frame of the first camera, x right, y down, z forward, up to scale; and confidences."""

    points: Float[Tensor, "b h w 3"]
    confidence: Float[Tensor, "b h w"]


class LinearHead(nn.Module):
    """Each token of the last layer becomes a square of pixels."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.patch = config.patch
        self.proj = nn.Linear(config.dec_dim, _CHANNELS * config.patch**2)

    def forward(self, taps: list[Tensor], rows: int, columns: int) -> Float[Tensor, "b 4 h w"]:
        """Raw channels from the tokens of all layers."""
        return functional.pixel_shuffle(_as_image(self.proj(taps[-1]), rows, columns), self.patch)


class DptHead(nn.Module):
    """Four layers of tokens, brought to four resolutions and merged from coarse to fine."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        depth = config.dec_depth
        self.hooks = (0, 2 * depth // 4, 3 * depth // 4, depth)
        self.dpt = Dpt(config)

    def forward(self, taps: list[Tensor], rows: int, columns: int) -> Float[Tensor, "b 4 h w"]:
        """Raw channels from the tokens of all layers."""
        return self.dpt([_as_image(taps[hook], rows, columns) for hook in self.hooks])


class Dpt(nn.Module):
    """The DPT head on feature images; the names of its parts are those of the published weights."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        sizes = config.dpt
        a, b, c, d = sizes.layer_dims
        self.scratch = Scratch(sizes.layer_dims, sizes.feature_dim)
        self.head = nn.Sequential(
            nn.Conv2d(sizes.feature_dim, sizes.last_dim, 3, padding=1),
            nn.Upsample(scale_factor=2, mode="bilinear", align_corners=True),
            nn.Conv2d(sizes.last_dim, sizes.last_dim, 3, padding=1),
            nn.ReLU(inplace=True),
            nn.Conv2d(sizes.last_dim, _CHANNELS, 1),
        )
        encoded, decoded = config.enc_dim, config.dec_dim
        self.act_postprocess = nn.ModuleList(
            [
                nn.Sequential(nn.Conv2d(encoded, a, 1), nn.ConvTranspose2d(a, a, 4, 4)),
                nn.Sequential(nn.Conv2d(decoded, b, 1), nn.ConvTranspose2d(b, b, 2, 2)),
                nn.Sequential(nn.Conv2d(decoded, c, 1)),
                nn.Sequential(nn.Conv2d(decoded, d, 1), nn.Conv2d(d, d, 3, 2, 1)),
            ]
        )

    def forward(self, images: list[Tensor]) -> Float[Tensor, "b 4 h w"]:
        """Raw channels from four feature images."""
        finer = [part(x) for part, x in zip(self.act_postprocess, images, strict=True)]
        return self.head(self.scratch(finer))


class Scratch(nn.Module):
    """Projections to a common width and the merging of resolutions.

    ``refinenet4.resConfUnit1`` is in the published weights and never used.
    """

    def __init__(self, layer_dims: tuple[int, int, int, int], width: int) -> None:
        super().__init__()
        layers = [nn.Conv2d(channels, width, 3, padding=1, bias=False) for channels in layer_dims]
        self.layer1_rn, self.layer2_rn, self.layer3_rn, self.layer4_rn = layers
        # The same layers once more: checkpoints name them twice.
        self.layer_rn = nn.ModuleList(layers)
        self.refinenet1 = Fusion(width)
        self.refinenet2 = Fusion(width)
        self.refinenet3 = Fusion(width)
        self.refinenet4 = Fusion(width)

    def forward(self, images: list[Tensor]) -> Float[Tensor, "b c h w"]:
        """Features at half the resolution of the picture, from fine to coarse images."""
        first, second, third, fourth = (layer(x) for layer, x in zip(self.layer_rn, images, strict=True))
        rows, columns = third.shape[-2:]
        # A grid with an odd side was rounded up when it was halved.
        merged = self.refinenet4(fourth)[..., :rows, :columns]
        merged = self.refinenet3(merged, third)
        merged = self.refinenet2(merged, second)
        return self.refinenet1(merged, first)


class Fusion(nn.Module):
    """Adds a finer feature image to a merged one and doubles the resolution."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.out_conv = nn.Conv2d(width, width, 1)
        self.resConfUnit1 = ResidualUnit(width)
        self.resConfUnit2 = ResidualUnit(width)

    def forward(self, x: Float[Tensor, "b c h w"], finer: Tensor | None = None) -> Float[Tensor, "b c _ _"]:
        """Apply to features and an image of the same shape."""
        if finer is not None:
            x = x + self.resConfUnit1(finer)
        x = self.resConfUnit2(x)
        return self.out_conv(functional.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True))


class ResidualUnit(nn.Module):
    """Two convolutions added to their input."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(width, width, 3, padding=1)
        self.conv2 = nn.Conv2d(width, width, 3, padding=1)

    def forward(self, x: Float[Tensor, "b c h w"]) -> Float[Tensor, "b c h w"]:
        """Apply to features."""
        return x + self.conv2(functional.relu(self.conv1(functional.relu(x))))


def pointmap(raw: Float[Tensor, "b 4 h w"], config: NetworkConfig) -> Pointmap:
    """Points and confidences from the raw channels of a head."""
    last = raw.permute(0, 2, 3, 1)
    return Pointmap(
        _points(last[..., :3], config.depth_mode),
        _confidence(last[..., 3], config.conf_mode, config.conf_range),
    )


def _points(xyz: Float[Tensor, "b h w 3"], mode: DepthMode) -> Float[Tensor, "b h w 3"]:
    if mode == "linear":
        return xyz.contiguous()
    length = xyz.norm(dim=-1, keepdim=True)
    return xyz / length.clamp(min=1e-8) * (length.expm1() if mode == "exp" else length.square())


def _confidence(
    raw: Float[Tensor, "b h w"], mode: ConfidenceMode, bounds: tuple[float, float]
) -> Float[Tensor, "b h w"]:
    least, most = bounds
    if mode == "exp":
        return least + raw.exp().clamp(max=most - least)
    return least + (most - least) * raw.sigmoid()


def _as_image(x: Float[Tensor, "b n d"], rows: int, columns: int) -> Float[Tensor, "b d {rows} {columns}"]:
    return x.transpose(1, 2).unflatten(-1, (rows, columns))
