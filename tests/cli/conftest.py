"""Running the command line inside the test process."""

import sys
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from dreamdrive.cli.main import main


@dataclass(frozen=True)
class Outcome:
    """How a command ended and what it said, white space evened out."""

    code: int
    out: str
    err: str


Run = Callable[..., Outcome]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """A function that runs ``dreamdrive`` with the given arguments."""

    def call(*arguments: object) -> Outcome:
        code = code_of(monkeypatch, *arguments)
        said = capsys.readouterr()
        assert "Traceback" not in said.out + said.err
        return Outcome(code, " ".join(said.out.split()), " ".join(said.err.split()))

    return call


def code_of(patch: pytest.MonkeyPatch, *arguments: object) -> int:
    """How ``dreamdrive`` ends with the given arguments."""
    patch.setattr("sys.argv", ["dreamdrive", *map(str, arguments)])
    patch.setattr("sys.unraisablehook", sys.unraisablehook)  # the command sets its own
    try:
        main()
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0
