"""Weights from a file, found by its path or its name on a model hub, into a network.

What is missing, unreadable, damaged, of other keys, shapes or types, not finite, or no plain weights is an
InputError everywhere; nothing in a file is executed. In messages ``source`` or ``where`` is where something
was read, and ``expected`` which file is expected.
"""

import hashlib
import os
import pickle
import re
import struct
import warnings
import zipfile
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, cast

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor, nn

from dreamdrive.errors import InputError
from dreamdrive.files.paths import is_inside, open_file, read_text
from dreamdrive.files.tensor_file import DAMAGE, HEADER_BYTES, briefly, directory_bytes, header_problem

Network = TypeVar("Network", bound=nn.Module)
_SHOWN = 4
_NAME = re.compile(r"[A-Za-z0-9][\w.-]*/[\w.-]+")
_PICKLE_BYTES = 4_000_000
"""Most that ``torch.save`` may have written beside the tensors; 1000 tensors take 0.1 MB."""
_WIDEST, _DEEPEST = 65_536, 1000
"""Largest number that a configuration of a network may hold, and of what counts layers."""
_LAYERS = re.compile("layers|depth|blocks_num|num_blocks")
_STRETCHED = 1_000_000
"""Numbers that a tensor may show although fewer are stored."""
_BUILDING = (TypeError, ValueError, AttributeError, LookupError, OverflowError, MemoryError, AssertionError)
"""What a damaged pickle raises, which builds what its classes do not take."""
_READING = (RuntimeError, pickle.UnpicklingError, zipfile.BadZipFile, EOFError, OSError, struct.error)
_REFUSED = re.compile(r"GLOBAL (\S+) (?:was not an allowed global|whose module)")


def find_weights(given: str | Path) -> Path:
    """The file or folder that ``--weights`` means; nothing is ever downloaded.

    Args:
        given: A path, or ``owner/name`` of a model whose snapshot lies in the hub's cache (``HF_HUB_CACHE``,
            ``HF_HOME/hub`` or ``~/.cache/huggingface/hub``). What exists as a path is taken as one.

    Raises:
        InputError: Neither a path nor a cached model.
    """
    path = Path(given)
    if path.exists():
        return path
    name = str(given)
    if not _NAME.fullmatch(name) or path.suffix in (".pth", ".pt", ".safetensors"):
        raise InputError(f"--weights {name} does not exist; expected a file of weights or its folder")
    folder = cache() / f"models--{name.replace('/', '--')}"
    current = folder / "refs" / "main"
    commit = read_text(current, at_most=1000).strip() if current.is_file() else "none"
    snapshot = folder / "snapshots" / commit
    if not is_inside(commit) or not snapshot.is_dir():
        raise InputError(
            f"--weights {name} is neither a path nor a model in {cache()}; "
            f"to download it yourself: hf download {name}"
        )
    return snapshot


def cache() -> Path:
    """Where models of the hub are kept on this machine."""
    if given := os.environ.get("HF_HUB_CACHE"):
        return Path(given).expanduser()
    home = os.environ.get("HF_HOME", Path("~/.cache/huggingface"))
    return Path(home).expanduser() / "hub"


def load_network(
    make: Callable[[], Network], path: Path, expected: str, *, ignored: tuple[str, ...] = ()
) -> Network:
    """Build a network and fill it from a state dict of its own keys on disk, for inference.

    Keys that begin as one of ``ignored`` are of parts that are not used.
    """
    state = {k: v for k, v in read_state(path, expected).items() if not k.startswith(ignored or ("\0",))}
    return fill_network(make, state, str(path), expected)


def fill_network(
    make: Callable[[], Network], state: dict[str, Tensor], source: str, expected: str
) -> Network:
    """Build a network from a state dict of its keys, for inference in float32."""
    try:
        with torch.device("meta"):
            network = make()
    except (RuntimeError, OverflowError) as error:
        raise InputError(
            f"{source}: no network is of these sizes ({briefly(error)}); expected {expected}"
        ) from None
    return fill(network, state, source, expected)


def fill(network: Network, state: dict[str, Tensor], source: str, expected: str) -> Network:
    """Put weights in place of those of a network that is already built, for inference in float32.

    Of the keys, counters of batches may be missing, and all but one name of a shared tensor.
    """
    wanted = network.state_dict()
    counters = {key: torch.zeros((), dtype=torch.int64) for key in wanted if key.endswith("batches_tracked")}
    state = counters | _shared(wanted, state) | state
    wrong = misfits(*({key: value.shape for key, value in each.items()} for each in (wanted, state)))
    if wrong:
        raise InputError(f"{source} does not fit ({in_words(wrong)}); expected {expected}")
    _check_numbers(wanted, state, source, expected)
    values = {key: value.float() if value.is_floating_point() else value for key, value in state.items()}
    network.load_state_dict(values, assign=True)
    return network.eval().requires_grad_(False)


def read_state(path: Path, expected: str) -> dict[str, Tensor]:
    """The tensors of a state dict on disk, ``.safetensors`` or what ``torch.save`` wrote."""
    if path.suffix != ".safetensors":
        return as_state(read_torch(path, expected), str(path), expected)
    try:
        if problem := header_problem(path):
            raise SafetensorError(problem)
        return load_file(path)
    except DAMAGE as error:
        raise InputError(f"{path} is missing or damaged ({briefly(error)}); expected {expected}") from None


def read_torch(path: Path, expected: str, allowed: Sequence[type] = ()) -> Any:
    """What ``torch.save`` wrote, if it consists of tensors, plain values and the allowed classes."""
    if not path.is_file():
        raise InputError(f"{path} does not exist or is no file; expected {expected}")
    try:
        _check_archive(path)
        with warnings.catch_warnings(), torch.serialization.safe_globals(list(allowed)):
            warnings.simplefilter("ignore", UserWarning)  # of TorchScript, which then fails
            return torch.load(path, map_location="cpu", weights_only=True)
    except (*_READING, *_BUILDING) as error:
        refused = _REFUSED.search(str(error))
        about = f"; it asks for {refused.group(1)}, which is not executed" if refused else ""
        about = f"; {briefly(error)}" if isinstance(error, zipfile.BadZipFile) else about
        raise InputError(
            f"{path} cannot be read as plain weights (damaged, a TorchScript archive or a whole pickled "
            f"object{about}); expected {expected}"
        ) from None


def as_state(content: object, source: str, expected: str) -> dict[str, Tensor]:
    """A state dict, if that is what was read."""
    if not isinstance(content, dict) or not all(isinstance(value, Tensor) for value in content.values()):
        raise InputError(f"{source} holds no table of tensors; expected {expected}")
    for key, value in content.items():
        if problem := _problem(value):
            raise InputError(f"{source}: {briefly(key)} {problem}; expected {expected}")
    return {str(key): value for key, value in content.items()}


def check_sizes(values: object, where: str) -> None:
    """Whether whole numbers in a configuration are sizes that networks have, before one is built of them."""
    waiting: list[tuple[object, str, int]] = [(values, "", _WIDEST)]
    while waiting:
        value, name, limit = waiting.pop()
        if isinstance(value, dict):
            for key, each in cast("dict[str, object]", value).items():
                waiting.append((each, key, _DEEPEST if _LAYERS.search(key) else _WIDEST))
        elif isinstance(value, list):
            waiting += [(each, name, limit) for each in cast("list[object]", value)]
        elif isinstance(value, int) and abs(value) > limit:
            raise InputError(f"{where}: {name} is {value}; expected at most {limit}")


def sha256(path: Path) -> str:
    """Digest of a file."""
    try:
        with open_file(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from error


def _check_archive(path: Path) -> None:
    """Refuse an archive that unpacks to more than it holds; ``torch.save`` never compresses."""
    with open_file(path) as file:
        if file.read(4) != b"PK\3\4":
            return
        size = os.fstat(file.fileno()).st_size
        if directory_bytes(file) > HEADER_BYTES:
            raise zipfile.BadZipFile("it holds more parts than weights have")
        with zipfile.ZipFile(file) as archive:
            parts = archive.infolist()
    # TorchScript is compressed in part, and refused without being unpacked.
    script = any(part.filename.endswith("/constants.pkl") for part in parts)
    packed = any(part.compress_type != zipfile.ZIP_STORED for part in parts)
    if any(part.filename.endswith("/data.pkl") and part.file_size > _PICKLE_BYTES for part in parts):
        raise zipfile.BadZipFile("it holds more plain values than weights have")
    if not script and (packed or sum(part.file_size for part in parts) > size):
        raise zipfile.BadZipFile("it is compressed, as torch.save never does")


def _problem(value: Tensor) -> str | None:
    """What is wrong with a tensor from a file, whatever network it is for."""
    if value.layout is not torch.strided or value.is_quantized or value.device.type != "cpu":
        return "is no plain tensor"
    if value.numel() > max(_STRETCHED, value.untyped_storage().nbytes() // max(value.element_size(), 1)):
        return f"claims the shape {tuple(value.shape)}, more than the file holds"
    return None


def _check_numbers(
    wanted: Mapping[str, Tensor], state: Mapping[str, Tensor], source: str, expected: str
) -> None:
    """Whether tensors of the right shapes hold numbers of the right kind, all of them finite."""
    for key, value in state.items():
        if value.is_floating_point() != wanted[key].is_floating_point() or value.is_complex():
            raise InputError(
                f"{source}: {briefly(key)} holds {_name(value)}, not {_name(wanted[key])}; expected "
                f"{expected}"
            )
        # The extremes tell without a copy; what is not a number is its own extreme.
        if value.is_floating_point() and value.numel():
            low, high = torch.aminmax(value if value.element_size() > 1 else value.float())
            if not (torch.isfinite(low) and torch.isfinite(high)):
                raise InputError(
                    f"{source}: {briefly(key)} holds numbers that are not finite; copy the file again"
                )


def _name(value: Tensor) -> str:
    return str(value.dtype).removeprefix("torch.")


def _shared(wanted: dict[str, Tensor], state: dict[str, Tensor]) -> dict[str, Tensor]:
    """By its other names what the state holds under one of them: a .safetensors keeps one name of each."""
    names: dict[int, list[str]] = defaultdict(list)
    for key, value in wanted.items():
        if value.device.type != "meta":
            names[value.data_ptr()].append(key)
    held = {key: group for group in names.values() for key in group if len(group) > 1 and key in state}
    return {name: state[key] for key, group in held.items() for name in group}


def misfits(wanted: Mapping[str, Sequence[int]], given: Mapping[str, Sequence[int]]) -> dict[str, list[str]]:
    """What is wrong with shapes of tensors by key, by what it is; empty where all are as wanted."""
    found = {
        "missing": sorted(set(wanted) - set(given)),
        "unknown": sorted(set(given) - set(wanted)),
        "of a wrong shape": [
            f"{key} is {tuple(given[key])}, not {tuple(wanted[key])}"
            for key in sorted(set(wanted) & set(given))
            if tuple(given[key]) != tuple(wanted[key])
        ],
    }
    return {what: keys for what, keys in found.items() if keys}


def in_words(found: Mapping[str, list[str]]) -> str:
    """Misfits for a message, the first few of each kind."""
    return "; ".join(f"{len(keys)} {what}: {some(keys)}" for what, keys in found.items())


def some(keys: Sequence[str]) -> str:
    """The first few keys, for a message."""
    return ", ".join(map(briefly, keys[:_SHOWN])) + (", ..." if len(keys) > _SHOWN else "")
