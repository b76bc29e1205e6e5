"""Measurements on disk: each row knows what it was made from, when, on what, and by which code."""

import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dreamdrive.files.digest import digest
from dreamdrive_bench.common import keep
from dreamdrive_bench.common.machine import describe_machine

Row = dict[str, Any]


class Measurement:
    """Something that is measured and kept; a frozen dataclass of what its figures follow from."""

    @property
    def name(self) -> str:
        """For messages and files."""
        raise NotImplementedError

    @property
    def case(self) -> Row:
        """What is measured: all its figures follow from this and the code."""
        return asdict(self)

    def measure(self, runs: Path) -> Row:
        """The figures; what they need on disk lies in the folder of the results."""
        raise NotImplementedError


def result_of(job: Measurement, runs: Path) -> Path:
    """Its file."""
    return runs / "cases" / f"{job.name}.json"


def load(job: Measurement, runs: Path) -> Row | None:
    """Its row; None where there is none, the file is cut short, or another case was measured."""
    path = result_of(job, runs)
    return keep.load(path) if keep.is_current(path, _key(job)) else None


def forget(jobs: Sequence[Measurement], runs: Path) -> None:
    """Delete what was measured."""
    for job in jobs:
        result_of(job, runs).unlink(missing_ok=True)


def measure_all(jobs: Sequence[Measurement], runs: Path) -> list[Measurement]:
    """Measure what is not there, or failed; returns what failed, which is kept as such and stops nothing."""
    failed: list[Measurement] = []
    for job in jobs:
        kept = load(job, runs)
        if kept is not None and "failed" not in kept:
            continue
        began = time.perf_counter()
        try:
            found = job.measure(runs)
        except Exception as error:  # noqa: BLE001  (whatever it is, the others go on)
            found = {"failed": f"{type(error).__name__}: {error}"}
            failed.append(job)
        row = {"measurement": job.name, "measured_on": describe_machine(), **job.case, **found}
        keep.save(result_of(job, runs), _key(job), row)
        told = found.get("failed", f"{time.perf_counter() - began:.0f} s")
        print(f"{job.name}: {told}", file=sys.stderr, flush=True)
    return failed


def _key(job: Measurement) -> str:
    return digest({"kind": type(job).__name__, "case": job.case})
