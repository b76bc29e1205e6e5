"""Log of the steps of a training, a line of JSON each, that survives being cut short."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dreamdrive.files.output import new_file


class StepLog:
    """Lines of JSON in a file, each with its ``step``."""

    def __init__(self, path: Path, first: int) -> None:
        """Go on behind a step: lines of later ones, which are made again, and broken ones are cut off."""
        self._path = path
        kept = path.read_text(errors="replace").splitlines() if first and path.is_file() else []
        with new_file(path) as partial:
            partial.write_text("".join(f"{line}\n" for line in kept if _step(line) <= first))

    def add(self, step: int, content: Mapping[str, Any]) -> None:
        """Write a line."""
        with self._path.open("a") as file:
            file.write(json.dumps({"step": step, **content}) + "\n")


def _step(line: str) -> float:
    """The step of a line; infinite where a program ended while it wrote it."""
    try:
        return float(json.loads(line)["step"])
    except (ValueError, KeyError, TypeError):
        return float("inf")
