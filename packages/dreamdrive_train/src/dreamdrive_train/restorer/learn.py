"""What the restorer learns from its pairs."""

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.restore import ERROR, FIRST_PLANES, MOVES, UNSEEN, RestorerNetwork
from dreamdrive_train.pairs import PairTask
from dreamdrive_train.restorer.pairs import RANGE


def _mended(network: nn.Module, told: Float[Tensor, "n 16 h w"]) -> Float[Tensor, "n 3 h w"]:
    return network(told)


def _spoilt(told: Float[Tensor, "n 16 h w"]) -> Float[Tensor, "n 1 h w"]:
    """What moves, what is off in recorded views and what none of them saw."""
    which = [MOVES, ERROR, UNSEEN]
    return told[:, which].amax(dim=1, keepdim=True).clamp(0, 1)


def _in_other_colours(
    told: Float[Tensor, "n 16 h w"], truth: Float[Tensor, "n 3 h w"], generator: np.random.Generator
) -> tuple[Float[Tensor, "n 16 h w"], Float[Tensor, "n 3 h w"]]:
    """All pictures alike with less contrast, tinted, channels exchanged: what is copied has any colour."""
    told, truth = told.clone(), truth.clone()
    for one in range(len(told)):
        order = generator.permutation(3)
        scale = torch.from_numpy(generator.uniform(0.4, 1.0, 3)).float()[:, None, None]
        offset = torch.from_numpy(generator.uniform(0.0, 1.0, 3)).float()[:, None, None] * (1 - scale)
        for planes in (told[one, :3], *(told[one, first : first + 3] for first in FIRST_PLANES), truth[one]):
            planes[:] = planes[order] * scale + offset
    return told, truth


RESTORER = PairTask(RestorerNetwork, _mended, _spoilt, RANGE, "restorer.safetensors", _in_other_colours)
