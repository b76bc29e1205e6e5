"""The street network in a file: half precision, with what it was trained on."""

from pathlib import Path

import msgspec
import torch
from msgspec import Struct
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import JSON_RAISES
from dreamdrive.files.output import new_file
from dreamdrive.files.tensor_file import DAMAGE, briefly, header_problem
from dreamdrive.models import fill_network, read_state
from dreamdrive.street_network.network import StreetNetwork

EXPECTED = "weights of the street network, as dreamdrive train street writes them"
_KIND = "dreamdrive street network"
_VERSION = 1


class Training(Struct, frozen=True, forbid_unknown_fields=True):
    """What weights come from.

    ``data`` holds the SHA-256 of each ``records.jsonl`` by the folder's name, ``figures`` what was measured
    on records kept out, ``licence`` the text under which the weights may be used.
    """

    steps: int
    seed: int
    commit: str
    data: dict[str, str]
    figures: dict[str, float]
    licence: str
    kind: str = _KIND
    version: int = _VERSION


def write_network(network: StreetNetwork, training: Training, path: Path) -> None:
    """Write the weights in half precision; norms stay apart, so that training can go on from them."""
    state = {
        key: value.detach().to("cpu", torch.float16).contiguous()
        for key, value in network.state_dict().items()
        if value.is_floating_point()
    }
    with new_file(path) as partial:
        save_file(state, partial, {"training": msgspec.json.encode(training).decode()})


def read_network(path: Path) -> tuple[StreetNetwork, Training]:
    """A network and what it comes from, for training or to be folded."""
    training = _training(path)
    return fill_network(StreetNetwork, read_state(path, EXPECTED), str(path), EXPECTED), training


def _training(path: Path) -> Training:
    try:
        if problem := header_problem(path):
            raise SafetensorError(problem)
        with safe_open(path, "pt") as file:
            said = (file.metadata() or {}).get("training", "")
    except DAMAGE as error:
        raise InputError(f"{path} is missing or damaged ({briefly(error)}); expected {EXPECTED}") from None
    try:
        training = msgspec.json.decode(said, type=Training)
    except JSON_RAISES as error:
        raise InputError(
            f"{path} does not say what it was trained on ({briefly(error)}); expected {EXPECTED}"
        ) from None
    if (training.kind, training.version) != (_KIND, _VERSION):
        raise InputError(
            f"{path} holds a {briefly(training.kind)} of version {training.version}; expected {EXPECTED}, "
            f"version {_VERSION}"
        )
    return training
