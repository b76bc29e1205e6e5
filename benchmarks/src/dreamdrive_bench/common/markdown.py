"""Tables, and sections of a Markdown file that a benchmark writes anew."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from dreamdrive.files.output import new_file

NONE = "-"
Layout = Callable[[Sequence[str], Sequence[Sequence[str]]], str]
"""``table`` or ``columns``."""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def laid_out(cells: Mapping[str, Callable[[Any], str]], rows: Iterable[Any], layout: Layout) -> str:
    """A table of rows by the function that makes each column's cell; nothing without a row."""
    body = [[cell(row) for cell in cells.values()] for row in rows]
    return layout(list(cells), body) if body else ""


def grid(lines: Sequence[Sequence[str]]) -> str:
    """The same of lines, the first its head, with a line's end."""
    return table(lines[0], lines[1:]) + "\n"


def number(value: float | None, form: str = ".2f") -> str:
    """A cell; a dash for what was not measured or has no meaning."""
    return NONE if value is None else format(value, form)


def span(low: float | None, high: float | None, form: str = ".2f") -> str:
    """An interval behind a value; nothing where there is none."""
    return "" if low is None or high is None else f" ({low:{form}} to {high:{form}})"


def columns(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The same for a terminal: first column to the left, the others to the right."""
    first, *others = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    lines = [
        [line[0].ljust(first), *(cell.rjust(width) for cell, width in zip(line[1:], others, strict=True))]
        for line in [head, *rows]
    ]
    return "\n".join("  ".join(line) for line in lines)


def replace_section(path: Path, name: str, text: str) -> None:
    """Put ``text`` between the lines ``<!-- NAME: begin -->`` and ``<!-- NAME: end -->`` of a file."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    pattern = re.compile(f"(?<={re.escape(begin)}\n).*?(?={re.escape(end)})", re.DOTALL)
    old = path.read_text()
    if not pattern.search(old):
        raise SystemExit(f"--markdown: {path} has no lines {begin} and {end}")
    with new_file(path) as partial:
        partial.write_text(pattern.sub(lambda _: text.strip() + "\n", old))
