"""docs/commands.md, from what each command's ``--help`` says."""

import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

from dreamdrive.drive import MANOEUVRES
from dreamdrive.options import QUALITIES
from tests.conftest import ROOT

PAGE = ROOT / "docs/commands.md"
WIDTH = 129
"""As wide as it goes with one panel a line."""
TITLE = r"(?m)^ (\w[\w ]*?) *\n -{20,} *$"
"""What stands above the options of one kind, where the output is no terminal."""
NOTHING = "\N{EN DASH}"
HEAD = """# Commands

Generated from the help texts by `make snapshots`: change these. `dreamdrive COMMAND --help` shows the same,
`dreamdrive generate INPUT --help` first what that input takes, `dreamdrive --version` the version. Exit codes
and environment: [troubleshooting.md](troubleshooting.md#exit-codes).

An option without a default is off, or its text tells what holds without it.
"""

Help = Callable[..., str]


class Panel(NamedTuple):
    """A frame of the help: its title, what it says of itself, and its options: flags, default, text."""

    title: str
    about: str
    options: list[tuple[str, str, str]]


def commands(help_of: Help, *words: str) -> Iterator[str]:
    """Every command that takes options of its own, such as ``world make``."""
    inner = re.findall(r"^\W+• (\S+)", help_of(*words), re.MULTILINE)
    if not inner:
        yield " ".join(words)
    for name in inner:
        yield from commands(help_of, *words, name)


def page(help_of: Help) -> str:
    """The page, with a part for each command."""
    parts = {command: part(command, help_of(*command.split())) for command in commands(help_of)}
    rows = [
        f"| [`{each}`](#{each.replace(' ', '-')}) | {linked(about(help_of(*each.split())))} |"
        for each in parts
    ]
    table = "\n".join(["| command | what it does |", "| --- | --- |", *rows])
    steps = "\n".join(
        f"| `{name}` | {row.static.steps} | {row.fit.steps} |" for name, row in QUALITIES.items()
    )
    names = ", ".join(f"`{name}`" for name in MANOEUVRES)
    ends = [
        "## Names",
        "`--quality`, steps of both fits (longer clips take three for each training frame at least):",
        f"| name | as if nothing moved | joint fit |\n| --- | --- | --- |\n{steps}",
        f"`--trajectory` of `render`: {names}, or a file.",
    ]
    return "\n\n".join([HEAD + "\n" + table, *parts.values(), *ends]) + "\n"


def about(text: str) -> str:
    """What a command says of itself."""
    return " ".join(re.split(TITLE, text.partition("\n\n")[2], maxsplit=1)[0].split())


def part(command: str, text: str) -> str:
    """Usage, purpose and tables of one command."""
    usage = " ".join(text.partition("\n\n")[0].removeprefix("usage: ").split())
    blocks = [f"## `{command}`", f"`{usage}`", linked(about(text))]
    for panel in panels(text):
        rows = [f"| `{flags}` | {default} | {words} |" for flags, default, words in panel.options]
        blocks += [f"**{panel.title.capitalize()}**" + (f": {linked(panel.about)}" if panel.about else "")]
        blocks += ["\n".join(["| option | default | what |", "| --- | --- | --- |", *rows])]
    return "\n\n".join(blocks)


def panels(text: str) -> Iterator[Panel]:
    """The parts of a help, less the line of ``--help``."""
    parts = re.split(TITLE, text)
    for title, body in zip(parts[1::2], parts[2::2], strict=True):
        above, rule, below = body.rpartition(f"\n  {'-' * 20}")
        lines = [line[2:].rstrip() for line in (below.partition("\n")[2] if rule else body).splitlines()]
        options = [
            each for each in map(option, blocks([line for line in lines if line])) if "--help" not in each[0]
        ]
        if options:
            yield Panel(title, " ".join(above.split()), options)


def blocks(lines: list[str]) -> Iterator[list[str]]:
    """The lines of each option; a list of choices may go on at the border of the next line."""
    found: list[list[str]] = []
    for line in lines:
        if found and found[-1][-1].count("{") > found[-1][-1].count("}"):
            found[-1][-1] += line
        elif not line.startswith(" "):
            found.append([line])
        else:
            found[-1].append(line)
    return iter(found)


def option(lines: list[str]) -> tuple[str, str, str]:
    """Flags, default and text of an option or an argument."""
    flags, _, first = re.sub(r"\s{2,}", "\n", lines[0], count=1).partition("\n")
    text = " ".join(" ".join([first, *lines[1:]]).split())
    default = "required" if "(required)" in text else NOTHING
    if told := re.search(r"\(default: (.*?)\)", text):
        default = NOTHING if told[1] in ("None", "False") else told[1]
    words = re.sub(r" ?\((required|default: .*?)\)", "", text)
    return flags.replace("|", "\\|"), default.replace("|", "\\|"), linked(words.replace("|", "\\|"))


def linked(text: str) -> str:
    """Names of pages as links, and a dollar or star as it stands."""
    return re.sub(r"docs/([\w/]+\.md)", lambda it: f"[{it[1].rpartition('/')[2]}]({it[1]})", text)
