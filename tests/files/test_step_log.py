"""Lines of steps go on where a training goes on."""

import json
from pathlib import Path

import pytest

from dreamdrive.files.step_log import StepLog


def steps(path: Path) -> list[int]:
    return [json.loads(line)["step"] for line in path.read_text().splitlines()]


def test_lines_of_steps_that_are_made_again_are_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "losses.jsonl"
    log = StepLog(path, 0)
    for step in (10, 20, 30):
        log.add(step, {"loss": 0.5})
    again = StepLog(path, 20)
    again.add(25, {"loss": 0.25})
    assert steps(path) == [10, 20, 25]
    assert json.loads(path.read_text().splitlines()[-1]) == {"step": 25, "loss": 0.25}
    StepLog(path, 0)
    assert path.read_text() == ""


@pytest.mark.parametrize("end", ['{"step": 30, "lo', '{"loss": 1}', '{"step": "x"}', "[3]", "\xff"])
def test_a_line_that_a_kill_cut_short_is_no_obstacle(tmp_path: Path, end: str) -> None:
    path = tmp_path / "losses.jsonl"
    StepLog(path, 0).add(10, {"loss": 0.5})
    with path.open("a", encoding="latin-1") as file:
        file.write(end)
    StepLog(path, 30).add(31, {})
    assert steps(path) == [10, 31]
