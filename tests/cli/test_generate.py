"""What ``generate`` prints, and its exit code."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest

from dreamdrive.run import program_digest
from dreamdrive.run.report.outcome import Outcome
from tests.cli.conftest import Run

GENERATE = import_module("dreamdrive.generate")

GOOD = Outcome(False, 24, (96, 64), 700, 0, 0, {"fit": 3.0}, 0, None, None, (), ("known", "near"))
ROUGH = Outcome(
    *(True, 3, (96, 64), 700, 0, 0, {"fit": 3.0}, 0, None, None, ("it is dark",), ("known", "near")),
    program=program_digest(),
)


@pytest.mark.parametrize(
    ("outcome", "options", "code"),
    [(GOOD, (), 0), (GOOD, ("--strict",), 0), (ROUGH, (), 0), (ROUGH, ("--strict",), 3)],
)
def test_a_rough_result_is_an_error_only_for_those_who_ask(
    run: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    outcome: Outcome,
    options: tuple[str, ...],
    code: int,
) -> None:
    monkeypatch.setattr(GENERATE, "generate", lambda *_, say, **__: say("soon") or outcome)
    out = tmp_path / "out"
    result = run("generate", "--prior", "street-world", *options, "-o", out)
    assert result.code == code
    before = f"{out} is already finished; --from STAGE computes it again from a stage on "
    made = f"made a scene of 700 Gaussians with nothing that moves, from {outcome.frames} frames of 96x64, in"
    assert result.out == (
        f"soon {before if outcome is ROUGH else ''}{made} 3 s (fit 3 s) "
        f"{'rough because it is dark. ' if outcome is ROUGH else ''}metres known. aside near. "
        f"scene {out / 'scene'} videos {out / 'video'} report {out / 'report.json'}"
    )
    assert result.err == ""


def test_a_result_of_another_version_of_the_program_is_told_apart(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        GENERATE,
        "generate",
        lambda *_, **__: replace(ROUGH, program="of last week"),
    )
    said = run("generate", "--prior", "street-world", "-o", tmp_path / "out").out
    assert "is already finished, by another version of the program; --from STAGE computes it again" in said
