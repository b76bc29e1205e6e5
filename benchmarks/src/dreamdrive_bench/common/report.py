"""Reports: where they go, how many digits they have, and what a benchmark says of its failures."""

import argparse
import json
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from dreamdrive.files.output import new_file


def write(path: Path | None, text: str) -> None:
    """A report, if it is wanted; its folder is made."""
    if path is not None:
        with new_file(path) as partial:
            partial.write_text(text)


def as_json(report: dict[str, Any]) -> str:
    """JSON with six digits of every number, as more is noise, and each list of numbers on one line."""
    text = json.dumps(rounded(report), indent=1) + "\n"
    return re.sub(r"\[[^][{}\"]*\]", lambda numbers: " ".join(numbers[0].split()), text)


def rounded(value: Any) -> Any:
    """The same with six digits of every number."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def publish(options: argparse.Namespace, report: dict[str, Any], text: str, failed: Iterable[str]) -> int:
    """Print the tables, write ``--json`` and ``--markdown``, name what failed; the exit code."""
    print(text)
    write(options.json, as_json(report))
    write(options.markdown, text)
    return exit_code(failed)


def exit_code(failed: Iterable[str]) -> int:
    """Name what failed; 1 if anything did."""
    names = list(failed)
    for name in names:
        print(f"failed: {name}", file=sys.stderr)
    return 1 if names else 0
