"""The decoder: from the coarse street from above to its cells (Zhou and Krähenbühl 2022, section 3)."""

from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional


class Bottleneck(nn.Module):
    """ResNet's bottleneck, of one number of channels: to a quarter, 3 x 3, and back; added to its input."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        narrow = channels // 4
        self.conv1 = nn.Conv2d(channels, narrow, 1, bias=False)
        self.bn1 = nn.BatchNorm2d(narrow)
        self.conv2 = nn.Conv2d(narrow, narrow, 3, padding=1, bias=False)
        self.bn2 = nn.BatchNorm2d(narrow)
        self.conv3 = nn.Conv2d(narrow, channels, 1, bias=False)
        self.bn3 = nn.BatchNorm2d(channels)

    def forward(self, x: Float[Tensor, "n c h w"]) -> Float[Tensor, "n c h w"]:
        """Apply."""
        inner = functional.relu(self.bn1(self.conv1(x)))
        inner = functional.relu(self.bn2(self.conv2(inner)))
        return functional.relu(self.bn3(self.conv3(inner)) + x)


class BevDecoderBlock(nn.Module):
    """Doubles rows and columns; what the encoder said is added at each size.

    Args:
        channels: Of the input.
        out: Of the output.
        skip: Channels of the encoder.
    """

    def __init__(self, channels: int, out: int, skip: int) -> None:
        super().__init__()
        narrow = out // 2
        self.conv = nn.Sequential(
            nn.Upsample(scale_factor=2, mode="bilinear", align_corners=True),
            nn.Conv2d(channels, narrow, 3, padding=1, bias=False),
            nn.BatchNorm2d(narrow),
            nn.ReLU(),
            nn.Conv2d(narrow, out, 1, bias=False),
            nn.BatchNorm2d(out),
        )
        self.up = nn.Conv2d(skip, out, 1)

    def forward(self, x: Float[Tensor, "n c h w"], encoded: Float[Tensor, "n s h0 w0"]) -> Tensor:
        """Apply; gives (n, out, 2 h, 2 w)."""
        larger = self.conv(x)
        return functional.relu(larger + functional.interpolate(self.up(encoded), larger.shape[2:]))


class BevDecoder(nn.Module):
    """Blocks one after another, each of which sees the encoder's output, too."""

    def __init__(self, dim: int, channels: tuple[int, ...]) -> None:
        super().__init__()
        before = (dim, *channels)
        self.layers = nn.ModuleList(
            BevDecoderBlock(each, out, dim) for each, out in zip(before, channels, strict=False)
        )

    def forward(self, encoded: Float[Tensor, "n d h w"]) -> Tensor:
        """Gives (n, last channels, 2^k h, 2^k w) after k blocks."""
        x = encoded
        for layer in self.layers:
            x = layer(x, encoded)
        return x
