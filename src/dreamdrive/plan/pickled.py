"""Pickles of plain values and arrays, such as planners write them, read without running them."""

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Shaped

from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes
from dreamdrive.files.pickles import ARRAYS, DamagedError, Expected, Made, Name, follow

MOST_BYTES = 64_000_000
"""Of a file: 6019 plans take 1 MB."""
EXPECTED = Expected(
    ARRAYS | {"_codecs encode"},  # with protocol 2 bytes are text that is encoded
    5_000_000,  # 6019 plans as arrays take 160,000, as lists of numbers 300,000
    "a dictionary of arrays of NumPy or lists of numbers: save it so, with protocol 2 or higher, or as JSON",
)
_DEEPEST = 8


def read_pickle(path: Path) -> object:
    """The value in a pickle of protocol 2 to 5: dictionaries, lists, text, numbers, arrays of numbers.

    Raises:
        InputError: The file cannot be read, is damaged, or asks for anything else, which is named.
    """
    data = read_bytes(path, at_most=MOST_BYTES)
    try:
        return _plain(follow(data, path, EXPECTED), _DEEPEST, {})
    except (DamagedError, IndexError, ValueError, TypeError, OverflowError, MemoryError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{path} is damaged or no pickle of plain values and arrays ({error}); expected {EXPECTED.what}"
        ) from None


def _plain(value: Any, deeper: int, done: dict[int, Any]) -> Any:
    """A value whose calls have become numbers and arrays; what occurs twice is one and the same."""
    if deeper < 0:
        raise DamagedError("its values are nested too deep")
    if isinstance(value, Name):
        raise DamagedError(f"a value is the class {value.name} itself")
    if not isinstance(value, dict | list | tuple | Made):
        return value
    if id(value) not in done:
        if isinstance(value, Made):
            done[id(value)] = _array(value)
        elif isinstance(value, dict):
            pairs = cast("dict[Any, Any]", value).items()
            done[id(value)] = {key: _plain(each, deeper - 1, done) for key, each in pairs}
        else:
            done[id(value)] = [_plain(each, deeper - 1, done) for each in cast("list[Any]", value)]
    return done[id(value)]


def _array(made: Made) -> Shaped[np.ndarray, "..."]:
    """An array, or a number as an array without sides."""
    if made.name == "scalar":
        dtype, data = made.args
        return np.frombuffer(_bytes(data), _dtype(dtype))[:1].reshape(())
    if made.name == "_frombuffer":
        data, dtype, shape, order = made.args
        in_columns = order == "F"
    elif made.name == "_reconstruct" and made.state is not None:
        _, shape, dtype, in_columns, data = made.state
    else:
        raise DamagedError(f"a value is made by {made.name}, which makes no array")
    if not isinstance(shape, tuple) or not all(type(side) is int and side >= 0 for side in cast(Any, shape)):
        raise DamagedError("an array has no shape")
    kind, content = _dtype(dtype), _bytes(data)
    if math.prod(cast("tuple[int, ...]", shape)) * kind.itemsize != len(content):
        raise DamagedError("an array has another size than its shape says")
    return np.frombuffer(content, kind).reshape(
        cast("tuple[int, ...]", shape), order="F" if in_columns else "C"
    )


def _bytes(data: Any) -> bytes:
    if isinstance(data, Made) and data.name == "encode" and data.args[1:] == ("latin1",):
        data = str(data.args[0]).encode("latin1")
    if not isinstance(data, bytes | bytearray):
        raise DamagedError("an array has no bytes")
    return bytes(data)


def _dtype(made: Any) -> np.dtype[Any]:
    """Numbers; the state is a version, the byte order and what numbers have not."""
    if (
        not isinstance(made, Made)
        or made.name != "dtype"
        or made.args[0] not in ("f8", "f4", "f2", "i8", "i4")
    ):
        raise DamagedError("an array does not hold numbers")
    return np.dtype(made.args[0]).newbyteorder(
        ">" if made.state is not None and made.state[1] == ">" else "<"
    )
