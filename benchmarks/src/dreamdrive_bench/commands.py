"""The commands, one for each published figure, and how one of them is run."""

import ast
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from dreamdrive.errors import InputError

PROGRAM = "python -m dreamdrive_bench"
COMMANDS = {
    "ablation": "ablation.main",
    "bring": "drives.bring",
    "clips": "clips",
    "completion": "completion",
    "control": "control.main",
    "cuts": "cuts.main",
    "devkit": "devkit.main",
    "drives": "drives.main",
    "editing": "editing.main",
    "environment": "environment",
    "evaluate": "evaluate",
    "filling": "photo.filling",
    "film": "film",
    "fusion": "fusion.main",
    "geometry": "geometry.main",
    "gpu": "splat.gpu",
    "headline": "headline",
    "illustrations": "illustrations",
    "kill": "kill",
    "knowledge": "knowledge.main",
    "occupancy": "occupancy",
    "oracle": "oracle.main",
    "page": "page",
    "perception": "perception.main",
    "photo": "photo.main",
    "pinned": "pinned",
    "planners": "planners",
    "planning": "planning.main",
    "queues": "queues",
    "readme": "readme.main",
    "removed": "removed",
    "scale": "splat.scale",
    "scenarios": "planning.scenarios",
    "splat": "splat.main",
    "street": "street.main",
    "surround": "surround",
    "surfaces": "surfaces",
    "table1": "table1.main",
    "train_step": "splat.train_step",
    "training": "training.main",
    "trust": "trust.main",
    "wild": "wild.main",
}
"""Where the ``main`` of each is; the docstring of its module is its help."""


def main(arguments: Sequence[str]) -> int | None:
    """Run the command that the first argument names; without one, or with ``--help``, list all."""
    if arguments and arguments[0] in COMMANDS:
        return run(arguments[0], arguments[1:])
    if arguments and arguments[0] not in ("-h", "--help"):
        print(f"{arguments[0]} is none of {', '.join(COMMANDS)}", file=sys.stderr)
        return 2
    print(f"usage: {PROGRAM} NAME ...\n\nOne command for each published figure; each has --help.\n")
    for name in COMMANDS:
        print(f"  {name:<14}{said_of(name)}")
    return 0


def script(name: str, module: str) -> None:
    """What ``benchmarks/NAME.py`` does: run its command, unless a worker imports it."""
    if module == "__main__":
        sys.exit(run(name, sys.argv[1:]))


def run(name: str, arguments: Sequence[str]) -> int | None:
    """Run one command with its arguments; a user's mistake is one message and the exit code 2."""
    sys.argv = [f"{PROGRAM} {name}", *arguments]
    try:
        return import_module(f"dreamdrive_bench.{COMMANDS[name]}").main()
    except InputError as error:
        print(error, file=sys.stderr)
        return 2


def said_of(name: str) -> str:
    """The first line of a command's help; read, not imported."""
    path = Path(__file__).parent.joinpath(*COMMANDS[name].split(".")).with_suffix(".py")
    return (ast.get_docstring(ast.parse(path.read_text())) or "").partition("\n")[0]
