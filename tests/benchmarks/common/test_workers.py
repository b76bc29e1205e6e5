"""Fits side by side: order, one process a world, and failures that stop nobody."""

import os
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from dreamdrive_bench.common import workers
from dreamdrive_bench.common.places import ROOT


@dataclass(frozen=True)
class Write:
    """Writes its name, or fails."""

    name: str
    block: str
    owner: str
    folder: Path

    @property
    def result(self) -> Path:
        return self.folder / f"{self.name}.json"


def tasks(folder: Path) -> list[Write]:
    return [
        Write(f"{block}{owner}{k}", block, owner, folder)
        for block in "ab"
        for owner in "xy"
        for k in range(2)
    ]


def test_units_are_runs_of_one_block_and_owner(tmp_path: Path) -> None:
    found = workers.units(tasks(tmp_path))
    assert [[task.name for task in unit] for unit in found] == [
        ["ax0", "ax1"],
        ["ay0", "ay1"],
        ["bx0", "bx1"],
        ["by0", "by1"],
    ]


def test_an_owner_that_is_busy_is_passed_over(tmp_path: Path) -> None:
    waiting = workers.units(tasks(tmp_path))
    assert workers.next_unit(waiting, {"x"})[0].name == "ay0"
    assert workers.next_unit(waiting, {"x", "y"}) is None
    assert [unit[0].name for unit in waiting] == ["ax0", "bx0", "by0"]


PROGRAM = """
import os, sys
sys.path.insert(0, {benchmarks!r})
from pathlib import Path
from dataclasses import dataclass
from dreamdrive_bench.common.workers import work_off

@dataclass(frozen=True)
class Write:
    name: str
    block: str
    owner: str
    @property
    def result(self):
        return Path({folder!r}) / (self.name + ".json")

def make(task):
    if task.name == "ax0":
        raise ValueError("no road")
    if task.name == "ay0":
        os._exit(3)
    task.result.write_text(str(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1))

if __name__ == "__main__":
    tasks = [Write(b + o + str(k), b, o) for b in "ab" for o in "xy" for k in range(2)]
    print(",".join(task.name for task in work_off(tasks, make, 2)))
"""


@pytest.mark.slow
def test_a_failure_or_a_crash_is_named_and_the_others_go_on(tmp_path: Path) -> None:
    import subprocess

    program = tmp_path / "program.py"
    program.write_text(PROGRAM.format(benchmarks=str(ROOT / "benchmarks"), folder=str(tmp_path)))
    done = subprocess.run([sys.executable, str(program)], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "ax0,ay0"
    assert "no road" in (tmp_path / "ax0.error.txt").read_text()
    assert "code 3" in (tmp_path / "ay0.error.txt").read_text()
    assert len(list(tmp_path.glob("*.json"))) == 6
    if hasattr(os, "sched_getaffinity"):
        share = max(1, len(os.sched_getaffinity(0)) // 2)
        assert (tmp_path / "bx0.json").read_text() == str(share)
