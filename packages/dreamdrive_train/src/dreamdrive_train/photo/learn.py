"""What the network of the prior photo learns from its pairs."""

from typing import cast

import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.prior.photo.network import PhotoNetwork
from dreamdrive_train.pairs import PairTask
from dreamdrive_train.photo.pairs import RANGE


def _mended(network: nn.Module, told: Float[Tensor, "n 11 h w"]) -> Float[Tensor, "n 3 h w"]:
    return cast(PhotoNetwork, network)(told)[0]


def _spoilt(told: Float[Tensor, "n 11 h w"]) -> Float[Tensor, "n 1 h w"]:
    """What is made up, empty or stretched."""
    made_up = torch.maximum(1 - told[:, 3:4], told[:, 4:5])
    return torch.maximum(made_up, 0.5 * told[:, 5:6].clamp(0, 1))


PHOTO = PairTask(PhotoNetwork, _mended, _spoilt, RANGE, "photo.safetensors")
