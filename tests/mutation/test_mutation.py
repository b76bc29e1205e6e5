"""No mutated file makes a reader do anything but read or refuse; `-m tests.mutation` tries more."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.errors import InputError
from tests.mutation import runner
from tests.mutation.reader import Reader
from tests.mutation.readers import READERS
from tests.mutation.runner import Case, cases, run

QUICK, SLOW = 8, 5000
ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("reader", READERS)
def test_few_cases_of_every_reader(tmp_path: Path, reader: str) -> None:
    """Without the bounds that a process of its own has."""
    outcomes = [runner.tried(case, tmp_path) for case in cases([reader], QUICK, seed=0)]
    assert [str(outcome) for outcome in outcomes if outcome.verdict == "wrong"] == []


@pytest.mark.slow
def test_many_cases_of_every_reader() -> None:
    """In a process of its own: one that has run torch's threads cannot be forked."""
    count = str((SLOW // len(READERS) + 1) * len(READERS))
    command = [sys.executable, "-m", "tests.mutation", "--cases", count, "--seed", "1"]
    made = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert made.returncode == 0, f"{made.stdout}\n{made.stderr}"
    assert len(made.stdout.splitlines()) == 1 + len(READERS)


def trusting(folder: Path) -> None:
    """A reader that believes what it reads: all that the harness is there to find."""
    values = json.loads((folder / "a.json").read_text())
    if values["do"] == "crash":
        raise KeyError("do")
    if values["do"] == "nameless":
        raise InputError("it is wrong")
    if values["do"] == "wait":
        time.sleep(30)
    if values["do"] == "hoard":
        np.ones(100_000_000)
    if values["do"] == "refuse":
        raise InputError(f"{folder}: it is wrong")


@pytest.mark.parametrize(
    ("do", "verdict", "words"),
    [
        ("fine", "accepted", ""),
        ("refuse", "refused", "it is wrong"),
        ("crash", "wrong", "KeyError"),
        ("nameless", "wrong", "names no file"),
        ("wait", "wrong", "the process ended (SIGALRM): Timeout"),
        ("hoard", "wrong", "MB of memory"),
    ],
)
def test_each_kind_of_failure_is_seen(monkeypatch, do: str, verdict: str, words: str) -> None:
    def write(folder: Path) -> None:
        (folder / "a.json").write_text('{"do": "fine"}')

    def spoil(path: Path, _: object) -> str:
        path.write_text(json.dumps({"do": do}))
        return do

    monkeypatch.setitem(READERS, "trusting", Reader("trusting", write, trusting))
    monkeypatch.setattr(runner, "mutate", spoil)
    if do == "wait":
        monkeypatch.setattr(runner, "WAIT_S", 1.0)
    # The case after it is tried all the same.
    first, second = run([Case("trusting", number, 0) for number in (0, 1)])
    assert (first.verdict, second.verdict) == (verdict, verdict)
    assert words in first.said
    assert first.how.endswith(do) == (do != "wait")


def test_equal_cases_are_spoilt_alike(tmp_path: Path) -> None:
    case = Case("poses-tum", 7, 3)
    first, second = (runner.tried(case, tmp_path / name) for name in "ab")
    assert first.how == second.how
