"""Texts that are kept, so that a change of them shows: ``make snapshots`` writes them anew."""

import difflib
import os
from pathlib import Path

RENEW = "DREAMDRIVE_SNAPSHOTS"
"""Set to ``renew``, texts that differ are written in place of being a failure."""


def agrees(file: Path, text: str) -> None:
    """Compare a text with the one that is kept in a file."""
    kept = file.read_text() if file.is_file() else ""
    if kept == text:
        return
    if os.environ.get(RENEW) == "renew":
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
        return
    changes = difflib.unified_diff(kept.splitlines(), text.splitlines(), "kept", "now", n=0, lineterm="")
    raise AssertionError(f"{file.name} is another; if that is meant: make snapshots\n" + "\n".join(changes))


def part_agrees(file: Path, title: str, text: str) -> None:
    """Compare a text with the part of this title that is kept in a file; blank lines separate parts."""
    parts = parts_of(file)
    parts[title] = text
    agrees(file, "\n".join(f"{title}\n{part}\n" for title, part in sorted(parts.items())))


def parts_of(file: Path) -> dict[str, str]:
    """What is kept in a file of parts, by their titles."""
    blocks = file.read_text().strip().split("\n\n") if file.is_file() else []
    return {title: text for title, _, text in (block.partition("\n") for block in blocks)}
