"""Resident memory of this process, now and at the peak of a piece of work (Linux)."""

import ctypes
import gc
from collections.abc import Callable
from pathlib import Path

STATUS, CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")
RESET_PEAK = "5"  # see proc(5), clear_refs


def _status_bytes(name: str) -> int:
    line = next(line for line in STATUS.read_text().splitlines() if line.startswith(name + ":"))
    return 1024 * int(line.split()[1])


def resident_bytes() -> int:
    """What is resident once everything that is free has been given back to the system."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    return _status_bytes("VmRSS")


def peak_bytes(run: Callable[[], object]) -> int:
    """Most that was resident at any moment while ``run`` ran."""
    CLEAR.write_text(RESET_PEAK)
    run()
    return _status_bytes("VmHWM")
