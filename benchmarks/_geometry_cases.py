"""Measurements on disk: each row knows what it was made from, when, on what, and by which code."""

import datetime
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any, Protocol

import torch
from _machine import processor

from dreamdrive.files.atomic import new_file
from dreamdrive.run.stages import digest

Row = dict[str, Any]


class Measurement(Protocol):
    """Something that is measured and kept."""

    @property
    def name(self) -> str:
        """For messages and files."""
        ...

    @property
    def runs(self) -> Path:
        """Folder of the results."""
        ...

    @property
    def case(self) -> Row:
        """What is measured: all its figures follow from this and the code."""
        ...

    def measure(self) -> Row:
        """The figures."""
        ...


def fields_of(job: Any) -> Row:
    """Attributes of a measurement as they are in JSON, without the folder of the results."""
    return {key: value for key, value in asdict(job).items() if key != "runs"}


def result_of(job: Measurement) -> Path:
    """Its file."""
    return job.runs / "cases" / f"{job.name}.json"


def load(job: Measurement) -> Row | None:
    """Its row; None where there is none, the file is cut short, or another case was measured."""
    try:
        found = json.loads(result_of(job).read_text())
    except (FileNotFoundError, ValueError):
        return None
    return found if found.get("key") == _key(job) else None


def forget(jobs: Sequence[Measurement]) -> None:
    """Delete what was measured."""
    for job in jobs:
        result_of(job).unlink(missing_ok=True)


def measure_all(jobs: Sequence[Measurement]) -> list[Measurement]:
    """Measure what is not there, or failed; returns what failed, which is kept as such and stops nothing."""
    failed: list[Measurement] = []
    for job in jobs:
        kept = load(job)
        if kept is not None and "failed" not in kept:
            continue
        began = time.perf_counter()
        try:
            found = job.measure()
        except Exception as error:  # noqa: BLE001  (whatever it is, the others go on)
            found = {"failed": f"{type(error).__name__}: {error}"}
            failed.append(job)
        _keep(job, found)
        told = found.get("failed", f"{time.perf_counter() - began:.0f} s")
        print(f"{job.name}: {told}", file=sys.stderr, flush=True)
    return failed


def _keep(job: Measurement, figures: Row) -> None:
    row = {"key": _key(job), "measurement": job.name, "measured_on": measured_on(), **job.case, **figures}
    with new_file(result_of(job)) as partial:
        partial.write_text(json.dumps(row) + "\n")


def _key(job: Measurement) -> str:
    return digest({"kind": type(job).__name__, "case": job.case})


def measured_on() -> dict[str, str]:
    """Date, code and machine of a figure that is made now."""
    return {
        "date": datetime.date.today().isoformat(),
        "commit": commit(),
        "processor": processor(),
        "torch": torch.__version__,
    }


@cache  # what is imported is the code of the beginning
def commit() -> str:
    """The commit of the working tree, with ``-dirty`` where files differ from it."""
    command = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    try:
        found = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return found.stdout.strip()
