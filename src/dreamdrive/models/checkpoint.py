"""Checkpoints of a training: it goes on from one as if it had not been stopped.

What is random follows from the seed and the step, so that no state of generators is kept.
"""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import torch
from safetensors.torch import save_file
from torch import Tensor, nn

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import JSON_RAISES
from dreamdrive.files.output import new_file
from dreamdrive.files.paths import read_text
from dreamdrive.models import read_state

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_STATE = "checkpoint-{step}.safetensors"
_TABLE = "checkpoint.json"
_EXPECTED = "a checkpoint of the same training"


class _Table(msgspec.Struct, forbid_unknown_fields=True):
    step: int
    seconds: float
    options: dict[str, Any]
    data: dict[str, str]


def save_checkpoint(
    folder: Path,
    step: int,
    seconds: float,
    networks: tuple[nn.Module, nn.Module],
    optimiser: torch.optim.Optimizer,
    options: "DataclassInstance",
    data: Mapping[str, str],
) -> None:
    """Write the network, the averaged one and the optimiser after so many steps; the table comes last."""
    state: dict[str, Tensor] = {}
    for name, network in zip(("network", "averaged"), networks, strict=True):
        state |= {f"{name}.{key}": value for key, value in network.state_dict().items()}
    for index, moments in optimiser.state_dict()["state"].items():
        state |= {f"optimiser.{index}.{key}": value for key, value in moments.items()}
    with new_file(folder / _STATE.format(step=step)) as partial:
        save_file({key: value.detach().cpu().contiguous() for key, value in state.items()}, partial)
    table = _Table(step, seconds, _plain(options), dict(data))
    with new_file(folder / _TABLE) as partial:
        partial.write_bytes(msgspec.json.format(msgspec.json.encode(table), indent=1))
    for old in folder.glob(_STATE.format(step="*")):
        if old.name != _STATE.format(step=step):
            old.unlink()


def load_checkpoint(
    folder: Path,
    networks: tuple[nn.Module, nn.Module],
    optimiser: torch.optim.Optimizer,
    options: "DataclassInstance",
    data: Mapping[str, str],
) -> tuple[int, float]:
    """Go back to the checkpoint of a folder, if there is one; steps done and seconds they took."""
    if not (folder / _TABLE).is_file():
        return 0, 0.0
    try:
        table = msgspec.json.decode(read_text(folder / _TABLE), type=_Table)
    except JSON_RAISES as error:
        raise InputError(f"{folder / _TABLE}: {error}; expected {_EXPECTED}") from None
    if table.options != _plain(options) or table.data != dict(data):
        raise InputError(
            f"{folder} holds a training of other options or data; give the same ones to go on, or "
            "another --out"
        )
    path = folder / _STATE.format(step=table.step)
    state = read_state(path, _EXPECTED)
    try:
        for name, network in zip(("network", "averaged"), networks, strict=True):
            network.load_state_dict(_below(state, name))
        moments: dict[int, dict[str, Tensor]] = {}
        for key, value in _below(state, "optimiser").items():
            index, name = key.split(".", 1)
            moments.setdefault(int(index), {})[name] = value
        optimiser.load_state_dict(optimiser.state_dict() | {"state": moments})
    except (RuntimeError, ValueError, KeyError) as error:
        raise InputError(f"{path} does not fit ({str(error)[:200]}); expected {_EXPECTED}") from None
    return table.step, table.seconds


def _below(state: Mapping[str, Tensor], name: str) -> dict[str, Tensor]:
    return {key.removeprefix(f"{name}."): each for key, each in state.items() if key.startswith(f"{name}.")}


def _plain(options: "DataclassInstance") -> dict[str, Any]:
    """Options as a table reads them back; how often is logged or judged changes nothing that is learned."""
    kept = {
        name: value
        for name, value in asdict(options).items()
        if name not in ("validate_each", "log_each", "checkpoint_s")
    }
    return msgspec.json.decode(msgspec.json.encode(kept))
