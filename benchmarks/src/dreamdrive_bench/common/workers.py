"""Fits side by side: each worker is a process with cores of its own, and no two prepare the same case."""

import multiprocessing
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Protocol

from dreamdrive.compute.machine import available_cores
from dreamdrive.files.output import new_file
from dreamdrive_bench.common.machine import PASSIVE, use_threads


class Task(Protocol):
    """Something that leaves a file.

    Attributes:
        name: For messages.
        block: Tasks of a block and an owner that follow each other run in one process.
        owner: Tasks of one owner never run side by side, and in their order.
        result: The file.
    """

    name: str
    block: str
    owner: str
    result: Path


Unit = list[Task]
Make = Callable[[Task], None]


@dataclass
class _Running:
    """A process and what it was given."""

    process: BaseProcess
    unit: Unit
    cores: list[int]


def units(tasks: Sequence[Task]) -> list[Unit]:
    """Tasks that follow each other and share block and owner, together."""
    return [list(found) for _, found in groupby(tasks, lambda task: (task.block, task.owner))]


def next_unit(waiting: list[Unit], busy: set[str]) -> Unit | None:
    """The first whose owner is free, taken from those that wait."""
    for number, unit in enumerate(waiting):
        if unit[0].owner not in busy:
            return waiting.pop(number)
    return None


def error_file(task: Task) -> Path:
    """Where it is kept why a task failed."""
    return task.result.with_suffix(".error.txt")


def work_off(tasks: Sequence[Task], make: Make, workers: int) -> list[Task]:
    """Run all tasks, the first first; returns those that failed.

    A worker has its share of the cores, pinned where the system can. What a task raises is kept beside its
    result and the others go on; so they do if the process dies.
    """
    for task in tasks:
        error_file(task).unlink(missing_ok=True)
    _end_like_an_interruption()
    os.environ.setdefault(*PASSIVE)
    waiting, running = units(tasks), list[_Running]()
    shares, began = _shares(workers), time.perf_counter()
    try:
        while waiting or running:
            busy = {run.unit[0].owner for run in running}
            while shares and (unit := next_unit(waiting, busy)) is not None:
                running.append(_start(unit, make, shares.pop()))
                busy.add(unit[0].owner)
            wait([run.process.sentinel for run in running])
            for run in [run for run in running if not run.process.is_alive()]:
                running.remove(run)
                shares.append(run.cores)
                waiting = _left_over(run) + waiting
                _tell(tasks, began)
    finally:
        for run in running:
            run.process.terminate()
    return [task for task in tasks if not task.result.exists()]


def _end_like_an_interruption() -> None:
    """Let a request to terminate, or a terminal that goes away, stop the workers too, as Ctrl-C does."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)


def _shares(workers: int) -> list[list[int]]:
    """Cores of each worker; where the system names none, as many numbers."""
    known = hasattr(os, "sched_getaffinity")
    cores = sorted(os.sched_getaffinity(0)) if known else list(range(available_cores()))
    each = max(1, len(cores) // workers)
    return [[cores[(k * each + i) % len(cores)] for i in range(each)] for k in range(workers)]


def _start(unit: Unit, make: Make, cores: list[int]) -> _Running:
    process = multiprocessing.get_context("spawn").Process(target=_work, args=(unit, make, len(cores)))
    if not hasattr(os, "sched_setaffinity"):
        process.start()
        return _Running(process, unit, cores)
    # A process inherits its cores: pinned later, threads that libraries start on import would keep theirs.
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cores)
    process.start()
    os.sched_setaffinity(0, before)
    return _Running(process, unit, cores)


def _work(unit: Unit, make: Make, count: int) -> None:
    use_threads(count)
    for task in unit:
        began = time.perf_counter()
        try:
            make(task)
            spent = time.perf_counter() - began
            print(f"{task.name}: {spent:.0f} s with all its measuring", file=sys.stderr, flush=True)
        except Exception:  # noqa: BLE001  (whatever it is, the other fits go on)
            _keep_error(task, traceback.format_exc())


def _left_over(run: _Running) -> list[Unit]:
    """What a process that died has not come to; the task it died of has failed."""
    if run.process.exitcode == 0:
        return []
    left = [task for task in run.unit if not task.result.exists() and not error_file(task).exists()]
    if left:
        _keep_error(left[0], f"the process ended with code {run.process.exitcode}\n")
    return [left[1:]] if left[1:] else []


def _keep_error(task: Task, text: str) -> None:
    print(f"{task.name} failed:\n{text}", file=sys.stderr, flush=True)
    with new_file(error_file(task)) as partial:
        partial.write_text(text)


def _tell(tasks: Sequence[Task], began: float) -> None:
    over = [task for task in tasks if task.result.exists() or error_file(task).exists()]
    if over:
        spent = time.perf_counter() - began
        left_min = spent / len(over) * (len(tasks) - len(over)) / 60
        text = f"{len(over)}/{len(tasks)}, up to {over[-1].name}: about {left_min:.0f} min left"
        print(text, file=sys.stderr, flush=True)
