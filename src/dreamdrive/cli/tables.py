"""Figures on the terminal and on disk."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table

from dreamdrive.files.atomic import new_file

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
    Console(file=console.file, width=width, highlight=False).print(table)


def number(value: float | None) -> str:
    """Four significant digits, at most five behind the point; ``-`` for what is not there."""
    return "-" if value is None else f"{round(value, 5) + 0.0:.4g}"


def fixed(value: float | None, digits: int, factor: float = 1.0) -> str:
    """So many digits behind the point; ``-`` for what is not there."""
    return "-" if value is None else f"{value * factor:.{digits}f}"


def interval(low: float | None, high: float | None) -> str:
    """Both ends of an interval; ``-`` for one that is not there."""
    return "-" if low is None or high is None else f"{number(low)} to {number(high)}"


def write_json(path: Path, values: Mapping[str, Any]) -> None:
    """Write values as JSON, whole or not at all; a number that is not finite becomes null."""
    with new_file(path) as partial:
        partial.write_text(json.dumps(_plain(values), indent=2, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}  # pyright: ignore[reportUnknownVariableType]
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]  # pyright: ignore[reportUnknownVariableType]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
