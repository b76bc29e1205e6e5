"""The ledger of runs on test sets."""

import json
import re
from datetime import date

from tests.conftest import ROOT

LEDGER = json.loads((ROOT / "benchmarks" / "ledger.json").read_text())
FIELDS = {"date", "commit", "set", "command", "reason", "outcome", "file"}
KEPT = re.compile(r"[0-9a-f]{7,40}:benchmarks/results/[\w.-]+\.json")


def test_each_run_is_told_whole() -> None:
    assert len(LEDGER) > 20
    for run in LEDGER:
        assert FIELDS <= set(run) <= FIELDS | {"kept"}, run
        assert date.fromisoformat(run["date"]) >= date(2026, 11, 20)
        assert run["commit"] is None or re.fullmatch(r"[0-9a-f]{7,40}(-dirty)?", run["commit"]), run
        assert all(run[name] for name in ("set", "command", "reason", "outcome")), run
        assert (ROOT / run["command"].split()[0]).is_file(), run
        assert "kept" not in run or KEPT.fullmatch(run["kept"]), run


def test_files_that_are_named_are_there_and_none_twice() -> None:
    files = [run["file"] for run in LEDGER if run["file"] is not None]
    assert [file for file in files if not (ROOT / "benchmarks" / file).is_file()] == []
    assert len(files) == len(set(files))
    assert [run for run in LEDGER if run["file"] and "kept" in run] == []


def test_runs_stand_in_the_order_of_their_dates() -> None:
    dates = [run["date"] for run in LEDGER]
    assert dates == sorted(dates)


def test_results_of_test_worlds_are_entered() -> None:
    """A file of results that names a drawn world from 1000 on."""
    entered = {run["file"] for run in LEDGER}
    found = [
        f"results/{file.name}"
        for file in sorted((ROOT / "benchmarks" / "results").glob("*.json"))
        if re.search(r'"seed": 10\d\d\b|"set": "test"|"worlds": "test"', file.read_text())
    ]
    assert len(found) > 10
    assert [file for file in found if file not in entered] == []
