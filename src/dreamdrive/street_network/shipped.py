"""The network by the name of the weights that ship, or by a file of others."""

from copy import deepcopy
from functools import cache
from pathlib import Path

from dreamdrive.compute.device import CPU, chosen_device
from dreamdrive.errors import InputError
from dreamdrive.street_network.network import StreetNetwork
from dreamdrive.street_network.weights import EXPECTED, read_network

SHIPPED = "street"
"""The name of the weights that ship."""
NO_KNOWLEDGE = "none"
"""In place of weights: the street network is not asked."""
_FILE = Path(__file__).with_name("street.safetensors")


def load_knowledge(given: str | Path = SHIPPED) -> StreetNetwork:
    """The network with the weights that ship, or those in a file, ready to look on ``chosen_device``.

    Raises:
        InputError: There are none, or the file is of something else.
    """
    path, device = weights_of(given), chosen_device()
    network = _shipped(path) if given == SHIPPED else read_network(path)[0].folded()
    return network if device == CPU else deepcopy(network).to(device)


@cache
def _shipped(path: Path) -> StreetNetwork:
    """Read once: a run asks for it twice, and it takes 0.2 s."""
    return read_network(path)[0].folded()


def weights_of(given: str | Path = SHIPPED) -> Path:
    """The file of weights.

    Raises:
        InputError: There is none.
    """
    path = _FILE if given == SHIPPED else Path(given)
    if not path.is_file():
        wrong = "there is no such file; expected street, or"
        if given == SHIPPED:
            wrong = "this installation has no weights; give"
        raise InputError(f"--knowledge {given}: {wrong} a file of {EXPECTED}")
    return path
