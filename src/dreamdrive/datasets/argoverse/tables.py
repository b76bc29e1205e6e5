"""Tables of Argoverse 2 as columns of numpy: feather as downloaded, or CSV, which may be packed."""

import csv
import gzip
import io
import operator
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Shaped

from dreamdrive.datasets.argoverse.unpacked import rows_and_bytes
from dreamdrive.errors import InputError, installing
from dreamdrive.files.paths import read_bytes, text_in

MOST_BYTES, MOST_ROWS = 50_000_000, 100_000
"""Of a file, and of what it unpacks to: the boxes of a log take 2 MB in 12,000 rows."""
_MAGIC = 8
"""Bytes before the messages of a feather file; behind them it has a table of contents that is not needed."""
_ENDINGS = (".csv", ".csv.gz", ".feather")
"""The first that there is counts: who made a CSV of a table wants it to be read."""

Kind = type[int] | type[float] | type[str]
_TYPES: dict[type, Any] = {int: np.int64, float: np.float64, str: np.str_}
Columns = Mapping[str, Shaped[np.ndarray, " n"]]


def find_table(folder: Path, name: str) -> Path | None:
    """The file of a table, whatever its format; None where there is none."""
    return next((file for end in _ENDINGS if (file := folder / f"{name}{end}").is_file()), None)


def read_table(folder: Path, name: str, wanted: Mapping[str, Kind]) -> Columns:
    """The wanted columns of a table, whole numbers as int64.

    Args:
        folder: Of the log.
        name: Of the table, without the ending of its file.
        wanted: Names of columns, and what they hold.

    Raises:
        InputError: The table is missing or damaged, or lacks a column, or holds something else in it.
    """
    file = find_table(folder, name)
    if file is None:
        raise InputError(
            f"{folder} lacks the table {name}.feather, without which nothing of it can be read; expected the "
            "folder of a sensor log of Argoverse 2, with tables as .feather, .csv or .csv.gz"
        )
    given = (_of_feather if file.suffix == ".feather" else _of_csv)(file)
    missing = [column for column in wanted if column not in given]
    if missing:
        raise InputError(
            f"{file} has no columns {', '.join(missing)}; expected {name} as Argoverse 2 has it, with "
            f"{', '.join(wanted)}"
        )
    return {column: _numbers(given[column], kind, column, file) for column, kind in wanted.items()}


def _of_csv(file: Path) -> dict[str, Sequence[Any]]:
    data = read_bytes(file, at_most=MOST_BYTES)
    if file.suffix == ".gz":
        data = _unpacked(data, file)
    try:
        lines = csv.reader(io.StringIO(text_in(data), newline=""))
        rows = list(islice(lines, MOST_ROWS + 2))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{file} is damaged or no CSV ({error}); download it again") from None
    _check_rows(len(rows) - 1, file)
    head, *rows = [row for row in rows if row] or [[]]
    for number, row in enumerate(rows):
        if len(row) != len(head):
            raise InputError(
                f"{file} has {len(row)} values in row {number + 1} for {len(head)} columns; "
                "it is damaged or cut short, download it again"
            )
    return dict(zip(head, zip(*rows, strict=True), strict=True)) if rows else {name: () for name in head}


def _check_messages(messages: Iterable[Any], file: Path) -> None:
    """Refuse what would unpack to more than a table of one log has; nothing is unpacked."""
    rows = size = 0
    for message in messages:
        if message.type not in ("record batch", "dictionary"):
            continue
        dictionary = message.type == "dictionary"
        more = rows_and_bytes(message.metadata.to_pybytes(), memoryview(message.body), dictionary=dictionary)
        rows, size = rows + more[0], size + more[1]
    _check_rows(rows, file)
    if size > MOST_BYTES:
        raise InputError(f"{file} unpacks to over {MOST_BYTES / 1e6:.0f} MB; expected a table of one log")


def _check_rows(count: int, file: Path) -> None:
    if count > MOST_ROWS:
        raise InputError(f"{file} has over {MOST_ROWS} rows; expected a table of one log")


def _unpacked(data: bytes, file: Path) -> bytes:
    try:
        made = gzip.GzipFile(fileobj=io.BytesIO(data)).read(MOST_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{file} is damaged or cut short ({error}); download it again") from None
    if len(made) > MOST_BYTES:
        raise InputError(f"{file} unpacks to over {MOST_BYTES / 1e6:.0f} MB; expected a table of one log")
    return made


def _of_feather(file: Path) -> dict[str, Sequence[Any]]:
    try:
        import pyarrow as pa
        import pyarrow.ipc as ipc
    except ImportError:
        raise InputError(
            f"{file}: feather files are read by the package pyarrow, which is not installed; "
            f"{installing('argoverse')}, or give the table as .csv"
        ) from None
    data = read_bytes(file, at_most=MOST_BYTES)
    try:
        stream = pa.py_buffer(data[_MAGIC:])
        _check_messages(ipc.MessageReader.open_stream(stream), file)
        table = ipc.open_stream(stream).read_all()
        table.validate(full=True)
        return {name: table.column(name).to_pylist() for name in table.column_names}
    # What Arrow raises on damaged files; errors of input and output among them, as it reads buffers as files.
    except (pa.ArrowException, OSError, KeyError, ValueError, TypeError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{file} is damaged or no feather file ({error}); download it again") from None


def _numbers(values: Sequence[Any], kind: Kind, column: str, file: Path) -> Shaped[np.ndarray, " n"]:
    """Values of one kind, which may still be text."""
    made: Callable[[Any], Any] = _whole if kind is int else kind
    try:
        return np.array([made(value) for value in values], dtype=_TYPES[kind])
    except (TypeError, ValueError, OverflowError):
        what = {int: "whole number of 0 or more", float: "number", str: "text"}[kind]
        raise InputError(f"{file}: the column {column} holds what is no {what}; download it again") from None


def _whole(value: Any) -> int:
    number = int(value) if isinstance(value, str) else operator.index(value)
    if number < 0:
        raise ValueError("below 0")
    return number
