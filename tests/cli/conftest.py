"""Running the command line inside the test process."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from tests.test_pipeline import TINY, make, shorten

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


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short run; whoever changes it takes a copy."""
    out = tmp_path_factory.mktemp("run") / "out"
    with pytest.MonkeyPatch.context() as patch:
        shorten(patch)
        make(out, replace(TINY, frames="0:4", hold_out=None))
    return out
