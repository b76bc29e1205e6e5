"""docs/commands.md against what each command's ``--help`` says."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from dreamdrive.cli.main import main
from dreamdrive.drive import MANOEUVRES
from dreamdrive.options import QUALITIES

DOCUMENT = Path(__file__).parents[2] / "docs" / "commands.md"
NOTHING = "\N{EN DASH}"
FLAG = re.compile(r"--[a-z0-9-]+")

Help = Callable[..., str]


@pytest.fixture
def help_of(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Help:
    """What ``dreamdrive WORDS --help`` prints, as wide as it goes with one panel a line."""
    monkeypatch.setenv("COLUMNS", "129")

    def call(*words: str) -> str:
        monkeypatch.setattr("sys.argv", ["dreamdrive", *words, "--help"])
        with pytest.raises(SystemExit):
            main()
        return capsys.readouterr().out

    return call


def commands(help_of: Help, *words: str) -> Iterator[str]:
    """Every command that takes options of its own, such as ``world make``."""
    inner = re.findall(r"^\W+• (\S+)", help_of(*words), re.MULTILINE)
    if not inner:
        yield " ".join(words)
    for name in inner:
        yield from commands(help_of, *words, name)


def told(text: str) -> dict[str, tuple[str, tuple[str, ...]]]:
    """Default and choices of each option by its long name, from the text of ``--help``."""
    blocks: list[str] = []
    for line in text.splitlines():
        inside = line.strip("│ ")  # the frame is there on a terminal only
        if re.match(r"\W{1,2}--?[a-z]", line):
            blocks.append(inside)
        elif blocks:
            blocks[-1] += f" {inside}"
    return {FLAG.findall(block)[0]: (_default(block), _choices(block)) for block in blocks}


def _default(block: str) -> str:
    if "(required)" in block:
        return "required"
    found = re.search(r"\(default: (.*?)\)", block)
    return NOTHING if found is None or found[1] in ("None", "False") else found[1]


def _choices(block: str) -> tuple[str, ...]:
    found = re.search(r"\{(.*?)\}", block)
    return () if found is None else tuple(one for one in found[1].split(",") if one != "None")


def written() -> dict[str, dict[str, tuple[str, str]]]:
    """Default and words of each option in the tables of the document, by command."""
    sections = re.split(r"^## `(.+)`$", DOCUMENT.read_text(), flags=re.MULTILINE)
    return {
        command: {
            FLAG.findall(first)[0]: (default, words)
            for first, default, words in re.findall(r"^\| (`--.*?) \| (\S+) \| (.*) \|$", text, re.MULTILINE)
        }
        for command, text in zip(sections[1::2], sections[2::2], strict=True)
    }


def test_every_command_and_option_is_there_and_no_other(help_of: Help) -> None:
    document = written()
    found = {command: told(help_of(*command.split())) for command in commands(help_of)}
    assert set(document) == set(found)
    assert len(found["generate"]) > 20
    for command, options in found.items():
        options.pop("--help")
        defaults = {name: default for name, (default, _) in options.items()}
        assert {name: default for name, (default, _) in document[command].items()} == defaults, command
        for name, (_, choices) in options.items():
            words = document[command][name][1]
            assert [each for each in choices if f"`{each}`" not in words] == [], f"{command} {name}"


def test_names_that_the_help_does_not_list_are_complete() -> None:
    words = written()["render"]["--trajectory"][1]
    assert [name for name in MANOEUVRES if f"`{name}`" not in words] == []


def test_steps_of_each_quality() -> None:
    words = written()["generate"]["--quality"][1]
    for name, quality in QUALITIES.items():
        assert f"`{name}` {quality.static.steps} and {quality.fit.steps}" in words
