"""Tables, and sections of a Markdown file that a benchmark writes anew."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


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
    path.write_text(pattern.sub(lambda _: text.strip() + "\n", old))
