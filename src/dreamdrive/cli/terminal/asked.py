"""Flags in panels, made of the classes of what can be asked of each kind of input."""

import inspect
import re
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import field, fields, make_dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, get_args

from tyro.conf import UseAppendAction, arg

from dreamdrive.cli.terminal.arguments import DataSetName, parse_action, parse_actions, parse_size, parse_view
from dreamdrive.errors import InputError
from dreamdrive.files.given import check_given
from dreamdrive.scene.control import (
    Control,
    DataSetDrive,
    PhotoInput,
    RecordingInput,
    VideoModelInput,
    fields_of,
    flag_of,
)

_KINDS = {
    "data set": DataSetDrive,
    "recording": RecordingInput,
    "video model": VideoModelInput,
    "photo": PhotoInput,
}
"""In the order of their panels; a field stands in the first that has it."""
_READ: dict[str, Any] = {
    "action": str | None,
    "actions": UseAppendAction[tuple[str, ...]],
    "dataset": DataSetName | None,
    "size": str | None,
    "trajectory": Path | None,
    "view": str | None,
}
"""Types of flags whose fields hold something else."""
_MEANT: dict[str, Callable[[str], Any]] = {"action": parse_action, "size": parse_size, "view": parse_view}
_HELP = {"-h", "--help"}


class Asked:
    """The values of all flags, by panels."""

    def control(self, path: Path | None, seed: int) -> Control:
        """The input and how to read it; a file that is not there is told."""
        typed = {name: value for panel in vars(self).values() for name, value in vars(panel).items()}
        meant = parse_actions(typed.pop("actions", ()))
        given = {name: value for name, value in typed.items() if value is not None}
        meant |= {name: _MEANT[name](value) if name in _MEANT else value for name, value in given.items()}
        check_given(input=path, **{name: value for name, value in given.items() if isinstance(value, Path)})
        return Control(path, seed=seed, **meant)


def asked(command: str, *names: str) -> Any:
    """The type of an argument with the flags of these fields of ``Control``; without names of all.

    Not of ``weights`` and ``seed``, which others than the prior have, too.
    """
    skipped = 1 + len(command.split())
    return Annotated[
        Asked, arg(name="", constructor_factory=lambda: _panels(names or _all(), sys.argv[skipped:]))
    ]


def _all() -> list[str]:
    flags = fields_of(Control) - {"path", "action"}
    return [each.name for each in fields(Control) if each.name in flags]


def _panels(names: Iterable[str], words: list[str]) -> type[Asked]:
    """A panel for what the given input takes, in short, and one for what else is of each kind of input."""
    panels, left = [], list(names)
    rest = ((title, "", fields_of(kind)) for title, kind in _KINDS.items())
    for title, text, taken in (_first(words), *rest):
        if inside := [name for name in left if name in taken]:
            panels.append((f"panel{len(panels)}", _panel(title, text, inside)))
            left = [name for name in left if name not in taken]
    return make_dataclass("AskedInPanels", panels, bases=(Asked,))


def _panel(title: str, text: str, names: Iterable[str]) -> Any:
    """Flags below a title; with a text that says what they have in common, each is told in a sentence."""
    control, texts = {each.name: each for each in fields(Control)}, _texts()
    flags: list[Any] = []
    for name in names:
        kind, typed = get_args(control[name].type)
        flag = arg(
            name=flag_of(name).removeprefix("--"),
            prefix_name=False,
            metavar=typed.form or None,
            help=f"{texts[name].partition('. ')[0].removesuffix('.')}." if text else texts[name],
            help_behavior_hint=f"(default: {typed.usual})" if typed.usual else "",
        )
        default = () if name == "actions" else None
        flags.append((name, Annotated[_READ.get(name, kind), flag], field(default=default)))
    made = make_dataclass("Panel", flags)
    made.__doc__ = text
    return Annotated[made, arg(name=title)]


def _texts() -> dict[str, str]:
    """What each field is, from the docstring of its class."""
    found: dict[str, str] = {}
    for kind in Control.__mro__:
        attributes = (inspect.getdoc(kind) or "").partition("Attributes:\n")[2]
        for name, text in re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", attributes, re.MULTILINE):
            found.setdefault(name, " ".join(text.split()))
    return found


def _first(words: list[str]) -> tuple[str, str, frozenset[str]]:
    """Title, text and fields of the first panel: those that the input takes of which help is asked."""
    path = next((Path(word) for word in words[:1] if not word.startswith("-")), None)
    prior, dataset = (dict(pairwise(words)).get(flag) for flag in ("--prior", "--dataset"))
    if _HELP & set(words) and (path is not None or prior is not None):
        from dreamdrive.prior import taken_by

        with suppress(InputError):  # what is wrong is told when the work is asked for
            prior, taken = taken_by(Control(path, dataset=dataset), prior)
            return prior, f"What {path or 'a street of its own'} takes, by --prior {prior}.", taken
    common = fields_of(RecordingInput) - fields_of(DataSetDrive)
    return "recording", "The most common; INPUT --help tells what that input takes.", common
