"""All parts in one call: each a process with a time limit, all figures in one file as they come."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import torch

from dreamdrive_bench.common.places import ROOT
from dreamdrive_bench.common.report import as_json, write

PART = [sys.executable, "-m", "dreamdrive_bench.gpu.part"]
COMPILE = [sys.executable, "-c", "from dreamdrive.splat import load_gsplat; load_gsplat()"]
_PAUSE_S = 0.25
_LINES = 8
_PRETENDED = 4


@dataclass(frozen=True)
class Part:
    """A part, the seconds that it may take, and what has to be compiled before it."""

    name: str
    limit_s: float
    after: tuple[str, ...] = ("core",)


PARTS = (
    Part("networks", 170),
    Part("kernels", 75, ("core", "gsplat")),
    Part("fits", 150, ("core", "gsplat")),
    Part("steps", 75, ("core", "gsplat")),
    Part("generate", 75),
    Part("profile", 60, ("core", "gsplat")),
)
TWO_CORES = Part("two_cores", 200)
"""Beside the parts after the fits: these compute on the GPU and hardly on cores."""


@dataclass
class Job:
    """A process with its own group, what it says in a file, and since when it runs."""

    name: str
    process: subprocess.Popen[bytes]
    log: Path
    deadline: float
    begin: float = field(default_factory=time.monotonic)
    told: dict[str, Any] = field(default_factory=dict)

    def poll(self) -> bool:
        """Whether it is over; it is stopped at its deadline."""
        if self.told:
            return True
        code = self.process.poll()
        late = code is None and time.monotonic() > self.deadline
        if code is None and not late:
            return False
        if late:
            self.stop()
        self.told = {"seconds": time.monotonic() - self.begin, "code": self.process.returncode}
        if late:
            self.told["stopped"] = f"its {self.deadline - self.begin:.0f} s were over"
        if self.process.returncode:
            self.told["said"] = self.log.read_text(errors="replace").strip().splitlines()[-_LINES:]
        return True

    def stop(self) -> None:
        """End it and all that it began."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()


@dataclass
class Schedule:
    """Runs jobs until ``until`` on the clock, and keeps what they found in ``out``."""

    out: Path
    folder: Path
    until: float
    environment: dict[str, str]
    report: dict[str, Any] = field(default_factory=lambda: {"parts": {}, "compiled": {}})
    beside: list[Job] = field(default_factory=list)

    def start(self, name: str, command: Sequence[str | Path], limit_s: float, **how: Any) -> Job:
        """Start a process."""
        log = self.folder / f"{name}.log"
        with log.open("wb") as said:
            process = subprocess.Popen(
                command,
                cwd=ROOT,
                env=self.environment,
                stdout=said,
                stderr=said,
                start_new_session=True,
                **how,
            )
        now = time.monotonic()
        return Job(name, process, log, min(now + limit_s, self.until), now)

    def wait(self, jobs: list[Job], also: Callable[[], bool] = lambda: True) -> None:
        """Until all are over, or what else is waited for; figures are written meanwhile."""
        while not (all(job.poll() for job in jobs) and also()) and time.monotonic() < self.until:
            self.keep([*jobs, *self.beside])
            time.sleep(_PAUSE_S)
        self.keep([*jobs, *self.beside])

    def keep(self, jobs: list[Job]) -> None:
        """Put the figures of jobs into the report, and that into its file."""
        for job in jobs:
            path = self.folder / f"{job.name}.json"
            part = self.report["parts"] if path.name in PART_FILES else self.report["compiled"]
            found = json.loads(path.read_text()) if path.is_file() else {}
            part[job.name] = job.told | found
        write(self.out, as_json(self.report))


PART_FILES = {f"{part.name}.json" for part in (*PARTS, TWO_CORES)}


def machine() -> dict[str, Any]:
    """What is measured on."""
    told: dict[str, Any] = {"torch": torch.__version__, "cuda": torch.version.cuda, "cores": os.cpu_count()}
    told["python"] = sys.version.split()[0]
    if torch.cuda.is_available():
        told["gpu"] = torch.cuda.get_device_name()
        told["gpu_memory_gb"] = torch.cuda.get_device_properties(0).total_memory / 1e9
    return told


def core_command(build: Path, source: Path = ROOT) -> list[str]:
    """Compile the core and lay it beside its sources, where a path to them finds it."""
    make = (
        f"cmake -S {source} -B {build} -G Ninja -DPython_EXECUTABLE={sys.executable}"
        f" && cmake --build {build} && cp {build}/_native*.so {source}/src/dreamdrive/"
    )
    return ["bash", "-c", make]


def run_all(
    out: Path, pack: Path | None, *, minutes: float, pretend: bool, core: bool, only: Sequence[str] = ()
) -> int:
    """Everything, in the order of ``PARTS``; 1 where something failed."""
    begin = time.monotonic()
    environment = {"MAX_JOBS": "16", "PYTHONUNBUFFERED": "1", **os.environ}
    if not pretend and torch.cuda.is_available():
        high, low = torch.cuda.get_device_capability()
        environment.setdefault("TORCH_CUDA_ARCH_LIST", f"{high}.{low}")
    with TemporaryDirectory() as folder:
        schedule = Schedule(out, Path(folder), begin + 60 * minutes, environment)
        schedule.report["machine"] = machine()
        compiled: dict[str, Job] = {}
        if core:
            compiled["core"] = schedule.start("core", core_command(Path(folder) / "core"), 240)
        if not pretend:
            compiled["gsplat"] = schedule.start("gsplat", ["nice", "-n", "10", *COMPILE], 300)
        try:
            _run_parts(schedule, compiled, pack, pretend, only)
        finally:
            for job in (*compiled.values(), *schedule.beside):
                job.stop()
    failed = [name for name, told in schedule.report["parts"].items() if told.get("code", 1)]
    print(f"{time.monotonic() - begin:.0f} s in all" + (f"; failed: {', '.join(failed)}" if failed else ""))
    return int(bool(failed))


def _run_parts(
    schedule: Schedule, compiled: dict[str, Job], pack: Path | None, pretend: bool, only: Sequence[str]
) -> None:
    more = (["--pretend"] if pretend else []) + (["--pack", str(pack.resolve())] if pack else [])
    wanted = [part for part in PARTS if not only or part.name in only]

    def started(part: Part, **how: Any) -> Job:
        command = [*PART, part.name, "--json", str(schedule.folder / f"{part.name}.json"), *more]
        # Where a GPU is pretended, cores do what the limits are not meant for.
        return schedule.start(part.name, command, part.limit_s * (_PRETENDED if pretend else 1), **how)

    for part in wanted:
        schedule.wait([compiled[name] for name in part.after if name in compiled])
        schedule.keep(list(compiled.values()))
        if time.monotonic() > schedule.until - 5:
            schedule.report["parts"][part.name] = {"code": 1, "said": ["no time was left"]}
            schedule.keep([])
            continue
        job = started(part)
        schedule.wait([job])
        print(f"{part.name}: {_in_words(job.told)}", flush=True)
        if part.name == "fits":
            cores = sorted(os.sched_getaffinity(0))[-2:]
            beside = started(TWO_CORES, preexec_fn=lambda: os.sched_setaffinity(0, cores))  # noqa: B023
            schedule.beside.append(beside)
    schedule.wait(schedule.beside)


def _in_words(told: dict[str, Any]) -> str:
    how = told.get("stopped") or ("done" if told.get("code") == 0 else f"failed with code {told.get('code')}")
    return f"{how}, {told.get('seconds', 0):.1f} s" + "".join(f"\n  {line}" for line in told.get("said", []))
