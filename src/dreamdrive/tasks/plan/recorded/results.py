"""Files of planners' results: for each sample of nuScenes, by its token, six waypoints.

GPT-Driver and Agent-Driver write a pickled dictionary from tokens to arrays (6, 2); Agent-Driver's
``pred_trajs_dict.pkl`` is one. The same is read as JSON, and as NPZ with an array for each token, or with
``tokens`` and ``trajs``.
"""

import json
import sys
import warnings
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from tokenize import TokenError
from typing import Any, BinaryIO, cast

import numpy as np
from jaxtyping import Float, Shaped

from dreamdrive.errors import InputError
from dreamdrive.files.paths import open_file, read_text
from dreamdrive.files.tensor_file import briefly, directory_bytes
from dreamdrive.tasks.plan.recorded.pickled import MOST_BYTES, read_pickle
from dreamdrive.tasks.plan.trajectory import FARTHEST_M, STEPS, Plan

_TOKENS, _TRAJECTORIES = "tokens", "trajs"
_SHAPES = ((STEPS, 2), (1, STEPS, 2))
_LONGEST, _HUGE = 2 * STEPS, 1e300
_DIRECTORY_BYTES = 2_000_000
"""Most that the table of contents of an NPZ may hold: 6019 arrays take 0.5 MB."""
# What zipfile and NumPy raise on damaged files.
_DAMAGE = (
    *(OSError, ValueError, KeyError, EOFError, RuntimeError, TypeError),
    *(SyntaxError, TokenError, MemoryError, OverflowError, zlib.error),
)
_Entries = list[tuple[str, Any]]


@dataclass(frozen=True)
class PlannerResults:
    """What a planner wants to do in each of N samples.

    Attributes:
        tokens: Of the samples, each once, in the order of the file.
        waypoints_m: Half a second apart, in the planning frame: x right, y ahead (N, 6, 2).
    """

    tokens: tuple[str, ...]
    waypoints_m: Float[np.ndarray, "n 6 2"]

    def __post_init__(self) -> None:
        if len(self.tokens) != len(self.waypoints_m) or len(set(self.tokens)) != len(self.tokens):
            raise ValueError(
                f"{len(self.tokens)} tokens of {len(self.waypoints_m)} plans; expected each token once"
            )

    def __len__(self) -> int:
        return len(self.tokens)

    def plan(self, token: str) -> Plan:
        """The plan of one sample.

        Raises:
            InputError: There is none.
        """
        if token not in self.tokens:
            raise InputError(f"the planner's results have no sample {token}; they have {len(self)} others")
        return Plan(self.waypoints_m[self.tokens.index(token)])


def read_results(path: Path) -> PlannerResults:
    """A planner's results from ``.json``, ``.npz``, ``.pkl`` or ``.pickle``.

    Raises:
        InputError: The file cannot be read, has two entries of one token, or holds something else than six
            finite waypoints in metres for each.
    """
    read = _READERS.get(path.suffix.lower())
    if read is None:
        raise InputError(f"{path} is no file of a planner's results; expected {', '.join(_READERS)}")
    entries = read(path)
    if not entries:
        raise InputError(f"{path} holds no plan; expected a dictionary from tokens to six waypoints")
    _check_once(path, (token for token, _ in entries))
    waypoints = np.stack([_waypoints(value, f"{path}: {str(token)[:80]!r}") for token, value in entries])
    return PlannerResults(tuple(token for token, _ in entries), waypoints)


def _from_pickle(path: Path) -> _Entries:
    values = read_pickle(path)
    if not isinstance(values, dict):
        raise InputError(
            f"{path} holds a {type(values).__name__}; expected a dictionary from tokens to six waypoints"
        )
    named = cast("dict[Any, Any]", values)
    if not all(isinstance(token, str) for token in named):
        raise InputError(f"{path} has keys that are no text; expected tokens of samples")
    return list(named.items())


def _from_json(path: Path) -> _Entries:
    def refuse(word: str) -> float:
        raise InputError(f"{path} holds {word}, which is no place; leave the sample out")

    def once(pairs: _Entries) -> dict[str, Any]:
        made = dict(pairs)
        if len(made) < len(pairs):
            _check_once(path, (key for key, _ in pairs))
        return made

    try:
        values = json.loads(read_text(path), object_pairs_hook=once, parse_constant=refuse)
    except InputError:
        raise
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not JSON: {error}") from None
    if not isinstance(values, dict):
        raise InputError(
            f"{path} holds a {type(values).__name__}; expected an object from tokens to six waypoints"
        )
    return list(cast("dict[str, Any]", values).items())


def _from_npz(path: Path) -> _Entries:
    try:
        with open_file(path) as file:
            if directory_bytes(file) > _DIRECTORY_BYTES:
                raise InputError(f"{path} holds more files than planners' results; expected an array a token")
            entries = _members(path, file)
    except InputError:
        raise
    except (*_DAMAGE, zipfile.BadZipFile) as error:
        raise InputError(f"{path} cannot be read as an npz: {briefly(error)}") from None
    _check_once(path, (name for name, _ in entries))
    arrays = dict(entries)
    if set(arrays) != {_TOKENS, _TRAJECTORIES}:
        return entries
    tokens, plans = arrays[_TOKENS], arrays[_TRAJECTORIES]
    fit = tokens.ndim == 1 and plans.shape[:1] == tokens.shape and plans.shape[1:] in _SHAPES
    if not fit or not _is_text(tokens):
        raise InputError(
            f"{path}: {_TOKENS} is {tokens.dtype} of shape {tokens.shape}, {_TRAJECTORIES} of shape "
            f"{plans.shape}; expected n texts and numbers of shape (n, 6, 2)"
        )
    return list(zip(map(str, tokens), plans, strict=True))


def _members(path: Path, file: BinaryIO) -> list[tuple[str, Shaped[np.ndarray, "..."]]]:
    with zipfile.ZipFile(file) as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the age of a file, or of Python in it
        parts = archive.infolist()
        if sum(part.file_size for part in parts) > MOST_BYTES:
            raise InputError(
                f"{path} unpacks to over {MOST_BYTES / 1e6:.0f} MB; expected six waypoints a token"
            )
        return [(part.filename.removesuffix(".npy"), _member(archive, part)) for part in parts]


def _member(archive: zipfile.ZipFile, part: zipfile.ZipInfo) -> Shaped[np.ndarray, "..."]:
    with archive.open(part) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)


def _is_text(array: Shaped[np.ndarray, "..."]) -> bool:
    """Whether an array holds text; Python ends on letters beyond the last one of Unicode."""
    if array.dtype.kind != "U" or not array.dtype.itemsize:
        return False
    letters = np.ascontiguousarray(array).view(np.uint32 if array.dtype.isnative else ">u4")
    return bool((letters <= sys.maxunicode).all())


_READERS: dict[str, Callable[[Path], _Entries]] = {
    ".json": _from_json,
    ".npz": _from_npz,
    ".pkl": _from_pickle,
    ".pickle": _from_pickle,
}


def _check_once(path: Path, tokens: Iterable[str]) -> None:
    double = next((token for token, count in Counter(tokens).items() if count > 1), None)
    if double is not None:
        raise InputError(f"{path} has two entries {double[:80]!r}; expected one of each")


def _waypoints(value: Any, where: str) -> Float[np.ndarray, "6 2"]:
    """Six waypoints, which may be in a batch of one."""
    found = _numbers(value, 3)
    if found is None or found.shape not in _SHAPES:
        said = "holds no numbers in rows" if found is None else f"has the shape {found.shape}"
        raise InputError(f"{where} {said}; expected {STEPS} waypoints of x and y, half a second apart")
    waypoints = found.reshape(STEPS, 2).astype(np.float64)
    if not np.isfinite(waypoints).all():
        raise InputError(f"{where} holds a number that is not finite; leave the sample out")
    if np.abs(waypoints).max() > FARTHEST_M:
        raise InputError(
            f"{where} leads {np.abs(waypoints).max():.0f} m away in three seconds; expected metres from the "
            f"car, at most {FARTHEST_M:.0f}"
        )
    return waypoints


def _numbers(value: Any, deeper: int) -> Shaped[np.ndarray, "..."] | None:
    """Lists in lists as an array; None where they do not hold numbers, differ in length or are long."""
    if isinstance(value, np.ndarray):
        return value if value.dtype.kind in "fiu" else None
    if type(value) in (int, float):
        return np.array(value if abs(value) < _HUGE else np.inf, np.float64)
    if not isinstance(value, list) or not deeper or len(cast("list[Any]", value)) > _LONGEST:
        return None
    rows = [_numbers(each, deeper - 1) for each in cast("list[Any]", value)]
    arrays = [row for row in rows if row is not None]
    if len(arrays) < len(rows) or len({row.shape for row in arrays}) != 1:
        return None
    return np.stack(arrays)
