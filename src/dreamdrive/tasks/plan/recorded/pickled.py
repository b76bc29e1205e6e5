"""Pickles of plain values and arrays, such as planners write them, read without running them."""

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Shaped

from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes
from dreamdrive.files.pickles import ARRAYS, DamagedPickleError, Expected, Made, Name, follow

MOST_BYTES = 16_000_000
"""Of a file, and of the arrays that it keeps as text: 6019 plans take 1 MB."""
EXPECTED = Expected(
    ARRAYS | {"_codecs encode"},  # with protocol 2 bytes are text that is encoded
    5_000_000,  # 6019 plans as arrays take 160,000, as lists of numbers 300,000
    "a dictionary of arrays of NumPy or lists of numbers: save it so, with protocol 2 or higher, or as JSON",
)
_DEEPEST, _MOST_SIDES = 8, 8


def read_pickle(path: Path) -> object:
    """The value in a pickle of protocol 2 to 5: dictionaries, lists, text, numbers, arrays of numbers.

    Raises:
        InputError: The file cannot be read, is damaged, or asks for anything else, which is named.
    """
    data = read_bytes(path, at_most=MOST_BYTES)
    try:
        return _Plain().value(follow(data, path, EXPECTED), _DEEPEST)
    except (DamagedPickleError, LookupError, ValueError, TypeError, OverflowError, MemoryError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{path} is damaged or no pickle of plain values and arrays ({error}); expected {EXPECTED.what}"
        ) from None


class _Plain:
    """Makes numbers and arrays of calls; what occurs twice is one and the same."""

    def __init__(self) -> None:
        self._done: dict[int, Any] = {}
        self._left = MOST_BYTES

    def value(self, value: Any, deeper: int) -> Any:
        """A value without calls in it."""
        if deeper < 0:
            raise DamagedPickleError("its values are nested too deep")
        if isinstance(value, Name):
            raise DamagedPickleError(f"a value is the class {value.name} itself")
        if not isinstance(value, dict | list | tuple | Made):
            return value
        if id(value) not in self._done:
            if isinstance(value, Made):
                made = self._array(value)
            elif isinstance(value, dict):
                pairs = cast("dict[Any, Any]", value).items()
                made = {key: self.value(each, deeper - 1) for key, each in pairs}
            else:
                made = [self.value(each, deeper - 1) for each in cast("list[Any]", value)]
            self._done[id(value)] = made
        return self._done[id(value)]

    def _array(self, made: Made) -> Shaped[np.ndarray, "..."]:
        """An array, or a number as an array without sides."""
        if made.name == "scalar":
            dtype, data = made.args
            return np.frombuffer(self._bytes(data), _dtype(dtype))[:1].reshape(())
        if made.name == "_frombuffer":
            data, dtype, shape, order = made.args
            in_columns = order == "F"
        elif made.name == "_reconstruct" and made.state is not None:
            _, shape, dtype, in_columns, data = made.state
        else:
            raise DamagedPickleError(f"a value is made by {made.name}, which makes no array")
        kind, content = _dtype(dtype), self._bytes(data)
        sides = _sides(shape)
        if math.prod(sides) * kind.itemsize != len(content):
            raise DamagedPickleError("an array has another size than its shape says")
        return np.frombuffer(content, kind).reshape(sides, order="F" if in_columns else "C")

    def _bytes(self, data: Any) -> bytes | bytearray:
        if isinstance(data, Made) and data.name == "encode" and data.args[1:] == ("latin1",):
            text = str(data.args[0])
            # A short file can have one long text encoded again and again.
            self._left -= len(text)
            if self._left < 0:
                raise DamagedPickleError(f"its arrays take over {MOST_BYTES / 1e6:.0f} MB")
            data = text.encode("latin1")
        if not isinstance(data, bytes | bytearray):
            raise DamagedPickleError("an array has no bytes")
        return data


def _sides(shape: Any) -> tuple[int, ...]:
    """A shape, refused before it is multiplied: a file can state thousands of numbers of 600 digits."""
    sides = cast("tuple[Any, ...]", shape)
    if not isinstance(shape, tuple) or len(sides) > _MOST_SIDES:
        raise DamagedPickleError("an array has no shape")
    if not all(type(side) is int and 0 <= side <= MOST_BYTES for side in sides):
        raise DamagedPickleError("an array has another size than its shape says")
    return sides


def _dtype(made: Any) -> np.dtype[Any]:
    """Numbers; the state is a version, the byte order and what numbers have not."""
    if (
        not isinstance(made, Made)
        or made.name != "dtype"
        or made.args[0] not in ("f8", "f4", "f2", "i8", "i4")
    ):
        raise DamagedPickleError("an array does not hold numbers")
    return np.dtype(made.args[0]).newbyteorder(
        ">" if made.state is not None and made.state[1] == ">" else "<"
    )
