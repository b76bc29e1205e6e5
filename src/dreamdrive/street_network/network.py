"""The street network: depth, classes, road users and the camera from one picture."""

from copy import deepcopy

import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.street_network.decoder import Decoder
from dreamdrive.street_network.encoder import ConvNorm, Encoder
from dreamdrive.street_network.prediction import Prediction

MULTIPLE_PX = 32
"""Sides of the pictures are multiples of it."""
_OFFSET_PX = 32.0
"""An offset of so many pixels is 1 inside, so that all outputs are of about one size."""
_SPREADS = (-4.0, 1.5)
"""Least and largest logarithm of the scale of depth: 2 %, and more than nothing known."""


class StreetNetwork(nn.Module):
    """From RGB pictures in [0, 1] to a ``Prediction``; 3.8 million parameters."""

    def __init__(self) -> None:
        super().__init__()
        self.encoder = Encoder()
        self.decoder = Decoder()

    def forward(self, pictures: Float[Tensor, "n 3 h w"]) -> Prediction:
        """See; the sides are multiples of ``MULTIPLE_PX``."""
        if pictures.shape[2] % MULTIPLE_PX or pictures.shape[3] % MULTIPLE_PX:
            raise ValueError(f"pictures of {tuple(pictures.shape)}, expected sides of multiples of 32 pixels")
        pictures = pictures.contiguous(memory_format=torch.channels_last)
        maps, users, camera, kept = self.decoder(self.encoder(pictures))
        maps, users = (
            each.float().contiguous(memory_format=torch.contiguous_format) for each in (maps, users)
        )
        return Prediction(
            log_depth=maps[:, 0],
            log_spread=maps[:, 1].clamp(*_SPREADS),
            classes=maps[:, 2:],
            centre=users[:, :3],
            offset=users[:, 3:] * _OFFSET_PX,
            camera=camera,
            features=kept.float(),
        )

    def folded(self) -> "StreetNetwork":
        """A copy for inference, whose norms are part of its convolutions."""
        copy = deepcopy(self).eval().requires_grad_(False)
        for module in copy.modules():
            if isinstance(module, ConvNorm):
                module.fold()
        return copy
