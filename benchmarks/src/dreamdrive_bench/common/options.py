"""The options that most benchmarks have, and sizes among them."""

import argparse
import re
from pathlib import Path


def parser_of(
    doc: str | None, *, runs: str | None = None, resume: bool = False, markdown: bool = False
) -> argparse.ArgumentParser:
    """A parser with ``--json``.

    Args:
        doc: The text at the top of the script, which is its help.
        runs: Adds ``--runs``, with this folder as default.
        resume: Adds ``--resume``.
        markdown: Adds ``--markdown``.
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    if runs is not None:
        parser.add_argument("--runs", type=Path, default=Path(runs), metavar="DIR", help="what is kept")
    if resume:
        parser.add_argument("--resume", action="store_true", help="keep what is finished")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    if markdown:
        parser.add_argument("--markdown", type=Path, metavar="FILE", help="where the tables go")
    return parser


def size_of(text: str) -> tuple[int, int]:
    """Width and height in pixels of e.g. 480x270; ``type`` of an option."""
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text}: expected WIDTHxHEIGHT, such as 480x270")
    return int(match[1]), int(match[2])
