"""Other people's networks, built from their installed package and filled from files on this machine."""

import importlib
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from torch import Tensor, nn

from dreamdrive.compute.device import chosen_device
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.models import as_state, check_sizes, fill, read_state, read_torch

Upstream = TypeVar("Upstream", bound=nn.Module)
_NAMES = ("model.safetensors", "model.pt", "model.pth")


@dataclass(frozen=True)
class StoredWeights:
    """Weights as they lie on disk, with what ``config.json`` beside them says, if it is there.

    In messages ``source`` is where they come from, and ``expected`` which are expected.
    """

    state: dict[str, Tensor]
    config: dict[str, Any]
    source: str
    expected: str

    def keep(self, prefix: str = "", without: tuple[str, ...] = ()) -> dict[str, Tensor]:
        """The state with a prefix taken off its keys, without those that then begin otherwise."""
        state = {key.removeprefix(prefix): value for key, value in self.state.items()}
        return {key: value for key, value in state.items() if not key.startswith(without or ("\0",))}


def read_stored(path: Path, expected: str, *, needs_config: bool = False) -> StoredWeights:
    """Read weights from a ``.safetensors``, ``.pt`` or ``.pth``, or a folder with ``model`` of that ending.

    Nothing in them is executed, nothing is fetched. ``config.json`` may lie beside them, or has to.
    """
    file = path
    if path.is_dir():
        there = [path / name for name in _NAMES if (path / name).is_file()]
        if not there:
            raise InputError(f"{path} holds none of {', '.join(_NAMES)}; expected {expected}")
        file = there[0]
    beside = file.parent / "config.json"
    if needs_config and not beside.is_file():
        raise InputError(f"{beside} does not exist; expected {expected}")
    config = read_json(beside, "--weights") if beside.is_file() else {}
    check_sizes(config, f"--weights {beside}")
    return StoredWeights(_read_state(file, expected), config, str(file), expected)


def _read_state(file: Path, expected: str) -> dict[str, Tensor]:
    if file.suffix == ".safetensors":
        return read_state(file, expected)
    content = read_torch(file, expected)
    wrapped = isinstance(content, dict) and isinstance(content.get("model"), dict)
    return as_state(content["model"] if wrapped else content, str(file), expected)


def upstream(module: str, install: str) -> Any:
    """A module of an optional package; how to install that is said where it is missing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the package's own age
            return importlib.import_module(module)
    except ImportError as error:
        raise InputError(f"{module} cannot be imported ({error}): {install}") from None


def build(make: Callable[[], Upstream], stored: StoredWeights, state: dict[str, Tensor]) -> Upstream:
    """Build a network and fill it with weights by its own keys, on the GPU where torch has one."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            network = make()
    except (TypeError, KeyError, AttributeError, ValueError, RuntimeError) as error:
        raise InputError(
            f"{stored.source}: the installed package does not build this network "
            f"({type(error).__name__}: {error}); expected {stored.expected}"
        ) from error
    return fill(network, state, stored.source, stored.expected).to(chosen_device())
