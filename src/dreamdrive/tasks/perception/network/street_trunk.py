"""The first layers of the street network as a trunk: EfficientNet-Lite0, which knows streets already."""

import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.street_network import StreetNetwork
from dreamdrive.tasks.perception.network.backbone import FilterConv
from dreamdrive.tasks.perception.network.constants import MEAN, SPREAD

LAYER_STARTS = (0, 3, 11)
"""First blocks of the two layers behind the stem, and the end of the last."""


class StreetTrunk(nn.Module):
    """Features at strides of 4 and 16 by the layers of the street network's encoder up to block 10.

    Attributes:
        channels: Of the two maps of features.
    """

    mean: Tensor
    spread: Tensor

    def __init__(self) -> None:
        super().__init__()
        encoder = StreetNetwork().encoder
        for name, module in list(encoder.named_modules()):
            if isinstance(module, nn.Conv2d) and module.groups > 1:
                parent, _, own = name.rpartition(".")
                setattr(encoder.get_submodule(parent), own, _filter(module))
        first, second, end = LAYER_STARTS
        parts = encoder.blocks[first:second], encoder.blocks[second:end]
        self.layers = nn.ModuleList([encoder.stem, *(nn.Sequential(*part) for part in parts)])
        self.channels = (24, 112)
        for name, values in (("mean", MEAN), ("spread", SPREAD)):
            self.register_buffer(name, torch.tensor(values)[:, None, None], persistent=False)

    def forward(self, pictures: Float[Tensor, "n 3 h w"]) -> list[Tensor]:
        """Features of pictures that are normalised as for ImageNet."""
        fine = self.fine(pictures)
        return [fine, self.layers[2](fine)]

    def fine(self, pictures: Float[Tensor, "n 3 h w"]) -> Float[Tensor, "n 24 y x"]:
        """The first of the two maps, of which ``layers[2]`` makes the other."""
        x = (pictures * self.spread + self.mean).contiguous(memory_format=torch.channels_last)
        # Of bytes, as it was trained: EfficientNet-Lite's own scale.
        return self.layers[1](self.layers[0]((x - 127 / 255) * (255 / 128)))


def _filter(conv: nn.Conv2d) -> FilterConv:
    """The same convolution, which bfloat16 does not slow down."""
    same = FilterConv(
        conv.in_channels,
        conv.out_channels,
        conv.kernel_size[0],
        conv.stride[0],
        conv.kernel_size[0] // 2,
        groups=conv.groups,
        bias=False,
    )
    same.weight = conv.weight
    return same
