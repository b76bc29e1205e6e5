"""Figures on the terminal and on disk."""

from collections.abc import Sequence
from pathlib import Path

import msgspec
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table

from dreamdrive.files.output import check_ending, check_regular, new_file

_UNLIMITED = 1000
"""Characters that no table is wide."""


def print_table(console: Console, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table of texts, the first column to the left, the others to the right; nothing is cut to a width."""
    table = Table(*columns, title=title, title_justify="left", box=None, pad_edge=False)
    for position, column in enumerate(table.columns):
        column.justify = "right" if position else "left"
        column.no_wrap = True
    wide = console.options.update(max_width=_UNLIMITED)
    for row in rows:
        table.add_row(*row)
    width = max(console.width, Measurement.get(console, wide, table).maximum)
    Console(file=console.file, width=width, highlight=False, markup=False, emoji=False).print(table)


def number(value: float | None) -> str:
    """Four significant digits, at most five behind the point; ``-`` for what is not there."""
    return "-" if value is None else f"{round(value, 5) + 0.0:.4g}"


def fixed(value: float | None, digits: int, factor: float = 1.0) -> str:
    """So many digits behind the point; ``-`` for what is not there."""
    return "-" if value is None else f"{value * factor:.{digits}f}"


def interval(low: float | None, high: float | None) -> str:
    """Both ends of an interval; ``-`` for one that is not there."""
    return "-" if low is None or high is None else f"{number(low)} to {number(high)}"


def check_files(*, json: Path | None, picture: Path | None = None) -> None:
    """Refuse before the work what a figure's file cannot be, and names of other kinds: of a letter, say."""
    for path, ending in ((json, ".json"), (picture, ".png")):
        if path is not None:
            check_ending(path, ending)
            check_regular(path)


def write_json(path: Path, values: object) -> None:
    """Write values as JSON, whole or not at all; a number that is not finite becomes null."""
    # NumPy's numbers, which msgspec does not know, are floating-point ones.
    text = msgspec.json.format(msgspec.json.encode(values, enc_hook=float), indent=2)
    with new_file(path) as partial:
        partial.write_bytes(text + b"\n")
