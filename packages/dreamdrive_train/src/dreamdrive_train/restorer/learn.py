"""What the restorer learns from its pairs."""

from jaxtyping import Float
from torch import Tensor, nn

from dreamdrive.restore import RestorerNetwork
from dreamdrive_train.pairs import PairTask
from dreamdrive_train.restorer.pairs import RANGE

_MOVES, _ERROR, _UNSEEN = 5, 6, 7


def _mended(network: nn.Module, told: Float[Tensor, "n 16 h w"]) -> Float[Tensor, "n 3 h w"]:
    return network(told)


def _spoilt(told: Float[Tensor, "n 16 h w"]) -> Float[Tensor, "n 1 h w"]:
    """What moves, what is off in recorded views and what none of them saw."""
    which = [_MOVES, _ERROR, _UNSEEN]
    return told[:, which].amax(dim=1, keepdim=True).clamp(0, 1)


RESTORER = PairTask(RestorerNetwork, _mended, _spoilt, RANGE, "restorer.safetensors")
