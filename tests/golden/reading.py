"""Golden numbers, those of the authors' programs: where they are, how they are read, how close is close.

They are in the folder ``DREAMDRIVE_GOLDEN``; without it, in the cut beside this file. Tests take all sizes
from the files, so that a set of other sizes in the same format does as well.
"""

import json
import os
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import safetensors.numpy
import safetensors.torch
import torch
from torch import Tensor

FOLDER = Path(os.environ.get("DREAMDRIVE_GOLDEN") or Path(__file__).parent)
CUT = "cut.json"
"""File that makes a folder a cut: what a test misses there was left out."""


class Table(dict[str, Any]):
    """Entries of a file by name. A test that asks for one that a cut left out is skipped."""

    def __missing__(self, name: str) -> Any:
        if is_cut():
            pytest.skip(f"{name} is left out of the cut of the golden numbers in {FOLDER}")
        raise KeyError(name)

    def under(self, prefix: str) -> "Table":
        """Entries whose names begin so, without the beginning."""
        return Table({k.removeprefix(prefix): v for k, v in self.items() if k.startswith(prefix)})

    def numbers(self, prefix: str) -> list[int]:
        """The numbers behind the prefix in names such as ``depth.3``, sorted."""
        found = (re.fullmatch(re.escape(prefix) + r"(\d+)", name) for name in self)
        return sorted(int(match[1]) for match in found if match)


def is_cut() -> bool:
    """Whether only a part of a set is there."""
    return (FOLDER / CUT).is_file()


def tensors(name: str) -> Table:
    """Tensors of a ``.safetensors`` or ``.npz``."""
    if name.endswith(".npz"):
        return Table({key: torch.from_numpy(value) for key, value in arrays(name).items()})
    return Table(safetensors.torch.load_file(_there(name)))


def arrays(name: str) -> Table:
    """The same as NumPy's."""
    if name.endswith(".npz"):
        return Table(np.load(_there(name)))
    return Table(safetensors.numpy.load_file(_there(name)))


def values(name: str) -> Table:
    """A table of a ``.json``."""
    return Table(json.loads(_there(name).read_text()))


def _there(name: str) -> Path:
    if not (FOLDER / name).is_file():
        pytest.skip(f"{name} is not among the golden numbers in {FOLDER}")
    return FOLDER / name


def cases(name: str, pattern: str = "(.+)") -> list[Any]:
    """What the group of a pattern finds in the names of a file's entries, for ``parametrize``."""
    found = {match[1] for key in _keys(name) if (match := re.fullmatch(pattern, key))}
    why = f"the golden numbers in {FOLDER} have no {pattern} in {name}"
    return sorted(found) or [pytest.param("", marks=pytest.mark.skip(reason=why))]


@cache
def _keys(name: str) -> tuple[str, ...]:
    file = FOLDER / name
    if not file.is_file():
        return ()
    if name.endswith(".json"):
        return tuple(json.loads(file.read_text()))
    if name.endswith(".npz"):
        return tuple(np.load(file).files)
    with safetensors.safe_open(file, "np") as stored:
        return tuple(stored.keys())


def relative(value: Tensor | np.ndarray, expected: Tensor | np.ndarray) -> float:
    """Largest difference as a share of the largest expected value: rounding grows with what is added up."""
    a, b = (torch.as_tensor(each).detach().double() for each in (value, expected))
    assert a.shape == b.shape
    apart, largest = float((a - b).abs().max()), float(b.abs().max())
    return apart / largest if largest else apart


def close(value: Tensor | np.ndarray, expected: Tensor | np.ndarray, limit: float, name: str = "") -> None:
    """Assert that values differ by no more than a share of the largest of them."""
    apart = relative(value, expected)
    assert apart <= limit, f"{name} differs by {apart:.1e} of the largest value; {limit:.0e} is allowed"
