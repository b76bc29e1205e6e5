"""What a figure was measured on."""

import datetime
import os
import platform
import time
from pathlib import Path

import torch

from dreamdrive.splat import native_info

QUIET = 0.05  # share of all cores that may be busy


def processor() -> str:
    """Name of the processor, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def busy_share(seconds: float = 1.0) -> float | None:
    """Share of all cores that others keep busy while this process sleeps (Linux)."""
    stat = Path("/proc/stat")
    if not stat.exists():
        return None
    before = [int(word) for word in stat.read_text().split()[1:9]]
    time.sleep(seconds)
    passed = [int(word) - old for word, old in zip(stat.read_text().split()[1:9], before, strict=True)]
    idle = passed[3] + passed[4]  # idle and waiting for a disk
    return round(1 - idle / sum(passed), 2)


def wait_until_quiet(patience_s: float) -> None:
    """Wait, but not longer than this, until others leave the cores alone."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end and (busy_share() or 0) > QUIET:
        pass


def describe_machine() -> dict[str, object]:
    """Processor, cores, instruction set, threads, what others do just now, date."""
    return {
        **native_info(),
        "processor": processor(),
        "cores": os.cpu_count(),
        "busy_before": busy_share(),
        "torch": torch.__version__,
        "date": datetime.date.today().isoformat(),
    }


def machine_line(machine: dict[str, object]) -> str:
    """The same as a phrase."""
    busy = "" if machine["busy_before"] is None else f", {100 * machine['busy_before']:.0f} % busy before"
    return (
        f"{machine['processor']}, {machine['cores']} cores, {machine['isa']}, {machine['threads']} threads, "
        f"{machine['date']}{busy}"
    )
