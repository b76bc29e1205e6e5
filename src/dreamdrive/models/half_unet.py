"""A U-Net on half of the pixels, of networks that mend pictures."""

from itertools import pairwise

from jaxtyping import Float
from torch import Tensor, nn


class _Block(nn.Module):
    """Two convolutions and what came in."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(width, width, 3, padding=1, padding_mode="replicate")
        self.second = nn.Conv2d(width, width, 3, padding=1, padding_mode="replicate")
        self.norm = nn.GroupNorm(8, width)

    def forward(self, x: Float[Tensor, "n c h w"]) -> Float[Tensor, "n c h w"]:
        return x + self.second(nn.functional.silu(self.first(nn.functional.silu(self.norm(x)))))


class HalfUNet(nn.Module):
    """From maps to maps of the same size, through levels at 1/2, 1/4, 1/8 and so on of it.

    Args:
        inputs: Maps that go in.
        outputs: Maps that come out; all 0 before it is trained.
        widths: Channels of each level, multiples of 8.
    """

    def __init__(self, inputs: int, outputs: int, widths: tuple[int, ...]) -> None:
        super().__init__()
        self.stem = nn.Conv2d(4 * inputs, widths[0], 3, padding=1, padding_mode="replicate")
        self.down = nn.ModuleList(nn.Conv2d(a, b, 2, stride=2) for a, b in pairwise(widths))
        self.enter = nn.ModuleList(nn.Sequential(_Block(width), _Block(width)) for width in widths)
        self.up = nn.ModuleList(nn.Conv2d(b, a, 1) for a, b in pairwise(widths))
        self.leave = nn.ModuleList(nn.Sequential(_Block(width), _Block(width)) for width in widths[:-1])
        self.answer = nn.Conv2d(widths[0], 4 * outputs, 3, padding=1, padding_mode="replicate")
        nn.init.zeros_(self.answer.weight)
        assert self.answer.bias is not None
        nn.init.zeros_(self.answer.bias)

    def answered(
        self, maps: Float[Tensor, "n i h w"]
    ) -> tuple[Float[Tensor, "n o h w"], Float[Tensor, "n c h2 w2"]]:
        """The maps that come out, and the last features; sides are multiples of 2."""
        x = self.stem(nn.functional.pixel_unshuffle(maps, 2))
        kept: list[Tensor] = []
        for level, block in enumerate(self.enter):
            x = block(x if level == 0 else self.down[level - 1](_even(x)))
            kept.append(x)
        for level in reversed(range(len(self.leave))):
            size = kept[level].shape[2:]
            wider = nn.functional.interpolate(self.up[level](x), scale_factor=2, mode="nearest")
            x = self.leave[level](kept[level] + wider[..., : size[0], : size[1]])
        return nn.functional.pixel_shuffle(self.answer(x.contiguous()), 2), x


def _even(x: Float[Tensor, "n c h w"]) -> Float[Tensor, "n c h2 w2"]:
    return nn.functional.pad(x, (0, x.shape[3] % 2, 0, x.shape[2] % 2), mode="replicate")
