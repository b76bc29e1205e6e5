"""What every method with a network needs: its table entry, weights from files and from the hub."""

from dreamdrive.models.backend import Backend
from dreamdrive.models.efficientnet import LITE0_STAGES
from dreamdrive.models.weights import (
    as_state,
    check_sizes,
    fill,
    fill_network,
    find_weights,
    in_words,
    load_network,
    misfits,
    read_state,
    read_torch,
    sha256,
    some,
)
