"""Running the command line inside the test process."""

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
        monkeypatch.setattr("sys.argv", ["dreamdrive", *map(str, arguments)])
        code: object = 0
        try:
            main()
        except SystemExit as stop:
            code = stop.code
        said = capsys.readouterr()
        assert "Traceback" not in said.out + said.err
        return Outcome(int(code or 0), " ".join(said.out.split()), " ".join(said.err.split()))  # type: ignore[call-overload]

    return call
