"""docs/commands.md against what each command's ``--help`` says."""

import re

import pytest

from dreamdrive.cli.main import main
from dreamdrive.drive import MANOEUVRES
from dreamdrive.options import QUALITIES
from tests.command_page import PAGE, WIDTH, Help, commands, option, page, panels
from tests.snapshot import agrees

SAID: dict[tuple[str, ...], str] = {}
"""What has been printed, for all tests."""


@pytest.fixture
def help_of(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Help:
    """What ``dreamdrive WORDS --help`` prints."""
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    monkeypatch.delenv("DREAMDRIVE_VISTA", raising=False)

    def call(*words: str) -> str:
        if words in SAID:
            return SAID[words]
        monkeypatch.setattr("sys.argv", ["dreamdrive", *words, "--help"])
        with pytest.raises(SystemExit):
            main()
        SAID[words] = capsys.readouterr().out
        return SAID[words]

    return call


def test_the_page_is_that_of_the_help(help_of: Help) -> None:
    agrees(PAGE, page(help_of))


def test_every_command_and_option_is_there(help_of: Help) -> None:
    """Counted without the parser of the page: every flag that a help has begins a line of its frame."""
    sections = re.split(r"^## `(.+)`$", PAGE.read_text(), flags=re.MULTILINE)
    written = dict(zip(sections[1::2], sections[2::2], strict=True))
    names = list(commands(help_of))
    assert set(names) == set(written)
    assert len(names) > 20
    for name in names:
        flags = re.findall(r"^  (?:-\w.*?, )?(--[a-z][a-z0-9-]*)", help_of(*name.split()), re.MULTILINE)
        flags.remove("--help")
        found = re.findall(r"^\| `(?:-\w .*?, )?(--[a-z][a-z0-9-]*)", written[name], re.MULTILINE)
        assert found == flags, name
        assert all(
            row.count("|") - row.count("\\|") == 4 for row in re.findall(r"^\|.*$", written[name], re.M)
        )


def test_flags_default_and_text_of_an_option() -> None:
    lines = ["--scene NAME|N          Which drive, see", "      docs/guides/data_sets.md. (default: 3)"]
    text = "Which drive, see [data_sets.md](guides/data_sets.md)."
    assert option(lines) == ("--scene NAME\\|N", "3", text)
    assert option(["--force", "    Replace it. (default: False)"]) == ("--force", "–", "Replace it.")  # noqa: RUF001


def test_what_a_panel_says_of_itself(help_of: Help) -> None:
    found = {panel.title: panel.about for panel in panels(help_of("generate"))}
    assert found["fit options"] == "How Gaussians are fitted."
    assert found["positional arguments"] == ""


def test_names_that_the_help_does_not_list_are_complete() -> None:
    words = PAGE.read_text()
    assert [name for name in MANOEUVRES if f"`{name}`" not in words] == []
    for name, quality in QUALITIES.items():
        assert f"| `{name}` | {quality.static.steps} | {quality.fit.steps} |" in words
