"""Tables of pandas, from what ``restricted`` wrote down of their pickles, as columns of numpy."""

import re
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Shaped

from dreamdrive.datasets.pandaset.restricted import Most, read_pickle
from dreamdrive.errors import InputError
from dreamdrive.files.pickles import Made

_DTYPE = re.compile(r"[fiu][1248]|b1|O8")
"""Numbers, truth and objects; of all other types of numpy none is needed."""
_MOST_COLUMNS = 64

Columns = Mapping[str, Shaped[np.ndarray, " n"]]


class _UnexpectedError(Exception):
    """What is no table as pandas writes them."""


def read_table(path: Path, most: Most) -> Columns:
    """The columns of a pickled table by their names; its index is left out.

    A file of a kilobyte can ask for gigabytes and hours: nothing is made that is more than ``most``.

    Raises:
        InputError: The file cannot be read, or holds no table.
    """
    made = read_pickle(path, most)
    try:
        return _columns(made, most.rows)
    except (
        _UnexpectedError,
        ValueError,
        TypeError,
        KeyError,
        IndexError,
        AttributeError,
        OverflowError,
    ) as error:
        raise InputError(
            f"{path} holds no table that can be read ({error}); expected one of pandas as PandaSet has it: "
            "download it again"
        ) from None


def _columns(made: object, most_rows: int) -> Columns:
    frame = _made(made, "DataFrame").state
    manager = _made(frame.get("_mgr", frame.get("_data")), "BlockManager")
    axes, blocks = _parts(manager)
    names = [str(name) for name in _array(_index(axes[0]).get("data"), _MOST_COLUMNS)]
    columns: dict[str, Shaped[np.ndarray, " n"]] = {}
    for values, places in islice(blocks, _MOST_COLUMNS):
        rows = _array(values, most_rows)
        numbers = _places(places, len(names))
        if rows.ndim != 2 or len(rows) != len(numbers):
            raise _UnexpectedError(f"a block of the shape {rows.shape} is to fill {len(numbers)} columns")
        columns |= {names[number]: row for number, row in zip(numbers, rows, strict=True)}
    if len(columns) != len(names) or len({len(column) for column in columns.values()}) > 1:
        raise _UnexpectedError(f"of the columns {', '.join(names)[:200]} some are missing, double or shorter")
    return columns


def _made(value: object, name: str) -> Made:
    if not isinstance(value, Made) or value.name != name:
        raise _UnexpectedError(f"expected a {name}, got {getattr(value, 'name', type(value).__name__)}")
    return value


def _parts(manager: Made) -> tuple[Any, Iterator[tuple[Any, Any]]]:
    """The axes, and of each block its values and places; pandas before 1.3 has them in a state."""
    if manager.state is None:
        blocks, axes = manager.args
        made = [_made(block, "_unpickle_block").args for block in blocks]
        return axes, ((args[0], args[1]) for args in made)
    state = manager.state[3]["0.14.1"]
    return state["axes"], ((block["values"], block["mgr_locs"]) for block in state["blocks"])


def _index(value: object) -> dict[str, Any]:
    kind, kept = _made(value, "_new_Index").args
    if kind.name != "Index":
        raise _UnexpectedError(f"the names of columns are a {kind.name}")
    return cast("dict[str, Any]", kept)


def _places(value: object, count: int) -> list[int]:
    """Which columns a block fills."""
    if isinstance(value, Made) and value.name == "slice":
        numbers = range(*slice(*value.args).indices(count))
    else:
        numbers = _array(value, _MOST_COLUMNS).tolist()
    return [range(count)[number] for number in numbers]


def _array(value: object, most: int) -> Shaped[np.ndarray, "..."]:
    """An array; of two sides the first are columns, of which there are few, and the last is ``most`` long."""
    if isinstance(value, Made) and value.name == "_frombuffer":
        data, dtype, shape, order = value.args
        in_columns = order == "F"
    else:
        _, shape, dtype, in_columns, data = _made(value, "_reconstruct").state
    kind = _dtype(dtype)
    sides = tuple(shape)
    if len(sides) not in (1, 2) or not all(type(side) is int and side >= 0 for side in sides):
        raise _UnexpectedError("an array has a shape of other than one or two numbers")
    if sides[-1] > most or sides[0] > max(most if len(sides) == 1 else 0, _MOST_COLUMNS):
        raise _UnexpectedError(f"an array has the shape {str(sides)[:60]}; expected at most {most} rows")
    if len(data) > 8 * most * _MOST_COLUMNS:
        raise _UnexpectedError("an array has more values than its shape")
    if kind.hasobject:
        flat = np.empty(len(data), dtype=object)
        flat[:] = [each if isinstance(each, str | float | int) else None for each in data]
    else:
        flat = np.frombuffer(data, dtype=kind)
    return flat.reshape(sides, order="F" if in_columns else "C")


def _dtype(value: object) -> np.dtype[Any]:
    """A plain type; its state is version, byte order and others that plain types have not."""
    made = _made(value, "dtype")
    code = made.args[0]
    if not isinstance(code, str) or not _DTYPE.fullmatch(code):
        raise _UnexpectedError(
            f"an array has the type {code[:20]}" if isinstance(code, str) else "a type has no name"
        )
    order = "<" if made.state is None else made.state[1]
    if order not in ("<", ">", "|", "="):
        raise _UnexpectedError("a type has no byte order")
    return np.dtype(code).newbyteorder(order)
