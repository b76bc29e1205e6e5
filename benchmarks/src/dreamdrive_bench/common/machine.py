"""What a figure was measured on."""

import argparse
import datetime
import os
import platform
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import torch

from dreamdrive.compute.machine import available_cores
from dreamdrive.splat import native_info, set_threads
from dreamdrive_bench.common.places import ROOT

T = TypeVar("T")
PASSIVE = "OMP_WAIT_POLICY", "passive"
"""Else threads that wait keep their core busy: beside other work a fit takes three times as long."""
QUIET = 0.05  # share of all cores that may be busy


def _commit() -> str:
    command = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    try:
        found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return found.stdout.strip()


COMMIT = _commit()
"""The commit of the code that is imported, with ``-dirty`` where files differ from it."""


def processor() -> str:
    """Name of the processor, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


class OthersWatch:
    """The load of other processes since this was made (Linux; elsewhere it is unknown)."""

    def __init__(self) -> None:
        self.before = self.now()

    @staticmethod
    def now() -> tuple[float, float, float]:
        """Seconds so far: of all cores, idle, and busy for this process and its finished children."""
        own = os.times()
        ours = own.user + own.system + own.children_user + own.children_system
        stat = Path("/proc/stat")
        if not stat.exists():
            return time.monotonic(), time.monotonic(), 0
        ticks = [int(word) / os.sysconf("SC_CLK_TCK") for word in stat.read_text().split()[1:9]]
        return sum(ticks), ticks[3] + ticks[4], ours

    def share(self) -> float:
        """Part of all cores that others took."""
        total, idle, ours = (now - then for now, then in zip(self.now(), self.before, strict=True))
        return round(max(0.0, total - idle - ours) / total, 2)


def busy_share(seconds: float = 1.0) -> float:
    """Part of all cores that others take just now."""
    watch = OthersWatch()
    time.sleep(seconds)
    return watch.share()


def wait_until_quiet(patience_s: float) -> None:
    """Wait, but not longer than this, until others leave the cores alone."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end and busy_share() > QUIET:
        pass


def undisturbed(measure: Callable[[], T], options: argparse.Namespace) -> tuple[T, float]:
    """Measure, and again while others disturb it: the quietest try, and what others took in it."""
    tries = []
    for _ in range(options.tries):
        wait_until_quiet(options.patience)
        watch = OthersWatch()
        result = measure()
        tries.append((result, watch.share()))
        if tries[-1][1] <= QUIET:
            break
    return min(tries, key=lambda one: one[1])


def add_threads(parser: argparse.ArgumentParser) -> None:
    """The number of threads, which ``use_threads`` takes."""
    parser.add_argument("--threads", type=int, metavar="N", help="threads (default: all cores)")


def use_threads(count: int | None) -> None:
    """As many threads for splatting and torch; None leaves both as they are."""
    if count is not None:
        set_threads(count)
        torch.set_num_threads(count)


def use_all_cores() -> None:
    """All cores of this process for splatting and torch, here and in processes that it starts."""
    os.environ.setdefault(*PASSIVE)
    use_threads(available_cores())


def add_patience(parser: argparse.ArgumentParser) -> None:
    """What to do about others on the machine."""
    parser.add_argument(
        "--patience", type=float, default=0, metavar="S", help="wait for idle cores, so many seconds at most"
    )
    parser.add_argument(
        "--tries", type=int, default=1, metavar="N", help="again, so often at most, while others disturb"
    )


def describe_machine() -> dict[str, object]:
    """Processor, cores, instruction set, threads, versions, date."""
    return {
        **native_info(),
        "processor": processor(),
        "cores": os.cpu_count(),
        "torch": torch.__version__,
        "commit": COMMIT,
        "date": datetime.date.today().isoformat(),
    }


def machine_line(machine: dict[str, object]) -> str:
    """The same as a phrase."""
    return (
        f"{machine['processor']}, {machine['cores']} cores, {machine['isa']}, {machine['threads']} threads, "
        f"{machine['date']}, others took up to {100 * machine['others']:.0f} % of the cores"
    )
