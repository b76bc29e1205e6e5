"""Rows of the geometry benchmark as cells of its tables."""

from collections.abc import Iterable
from typing import Any

from dreamdrive_bench.common.markdown import NONE, number
from dreamdrive_bench.geometry.cases import Row

FAILED = "failed"


def figure(row: Row, name: str, digits: int = 2) -> str:
    """The same of a figure of a row; no row is an empty one."""
    return FAILED if "failed" in row else number(row.get(name), f".{digits}f")


def yes(row: Row, name: str) -> str:
    """Whether something is so."""
    if "failed" in row:
        return FAILED
    value = row.get(name)
    return NONE if value is None else "yes" if value else "no"


def by_case(rows: Iterable[Row], *names: str) -> dict[tuple[Any, ...], list[Row]]:
    """Rows that agree in these respects, in their order."""
    found: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        found.setdefault(tuple(_fixed(row[name]) for name in names), []).append(row)
    return found


def _fixed(value: Any) -> Any:
    """The same as something that can be a key."""
    if isinstance(value, dict):
        return tuple(sorted(value.items()))
    return tuple(value) if isinstance(value, list) else value
