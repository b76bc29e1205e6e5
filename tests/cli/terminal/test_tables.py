"""Figures on the terminal and on disk."""

import io
import json
import os
from pathlib import Path

import pytest
from rich.console import Console

from dreamdrive.cli.terminal.tables import check_files, interval, number, print_table, write_json
from dreamdrive.errors import InputError


def test_a_table_is_never_cut() -> None:
    console = Console(file=io.StringIO(), width=20)
    print_table(console, "title", ("", "a long heading"), [("a name of some length", "1"), ("b", "22")])
    lines = [line.rstrip() for line in console.file.getvalue().splitlines()]  # type: ignore[attr-defined]
    assert lines[0] == "title"
    assert lines[2].split() == ["a", "name", "of", "some", "length", "1"]
    assert lines[3].startswith("b ")
    assert lines[3].endswith("22")


def test_numbers_have_four_digits() -> None:
    assert [number(v) for v in (None, 12345.6, 0.123456, -0.0000012, float("inf"))] == [
        "-",
        "1.235e+04",
        "0.1235",
        "0",
        "inf",
    ]
    assert interval(1, 2.5) == "1 to 2.5"
    assert interval(None, 2) == "-"


def test_what_is_not_finite_is_null(tmp_path: Path) -> None:
    write_json(tmp_path / "new" / "f.json", {"a": (1, float("nan")), "b": {"c": [float("inf"), "x", None]}})
    assert json.loads((tmp_path / "new" / "f.json").read_text()) == {
        "a": [1, None],
        "b": {"c": [None, "x", None]},
    }


@pytest.mark.parametrize(("name", "why"), [("a.txt", "ends in .json"), ("pipe.json", "no regular file")])
def test_a_place_that_cannot_be_is_refused_before_the_work(name: str, why: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.json")
    with pytest.raises(InputError, match=why):
        check_files(json=tmp_path / name)
    check_files(json=tmp_path / "new.json", picture=tmp_path / "new.png")
