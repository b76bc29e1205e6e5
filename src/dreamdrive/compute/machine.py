"""Cores and memory of this machine, and processes that work beside this one."""

import os
import signal
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing.synchronize import Event

    import torch

_LOOKS_S = 0.5
_PROC, _CGROUPS = Path("/proc"), Path("/sys/fs/cgroup")
_V1 = "memory.limit_in_bytes", "memory.usage_in_bytes"


def available_cores() -> int:
    """Cores this process may run on: those it is bound to, and of these what its container may take."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    shares = [share for folder in _groups("cpu") if (share := _cpu_share(folder)) is not None]
    return max(1, min([cores, *map(ceil, shares)]))


def free_bytes(device: "torch.device | None" = None) -> int | None:
    """Memory that this process may still take, here or on a GPU; None where the system does not tell.

    What the machine has left, what the process' containers have, and its own limit of address space.
    """
    if device is not None and device.type == "cuda":
        import torch

        # What torch holds without using it can be taken, too.
        held = torch.cuda.memory_reserved(device) - torch.cuda.memory_allocated(device)
        return torch.cuda.mem_get_info(device)[0] + held
    known = [_free_of_machine(), _free_address_space(), *map(_free_of_group, _groups("memory"))]
    return min((each for each in known if each is not None), default=None)


def _free_of_machine() -> int | None:
    try:
        lines = dict(line.split(":", 1) for line in (_PROC / "meminfo").read_text("ascii").splitlines())
        return int(lines["MemAvailable"].split()[0]) * 1024
    except (OSError, KeyError, ValueError):
        return None


def _free_address_space() -> int | None:
    """What ``ulimit -v`` leaves."""
    try:
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        if limit == resource.RLIM_INFINITY:
            return None
        pages = int((_PROC / "self" / "statm").read_text("ascii").split()[0])
        return max(0, limit - pages * resource.getpagesize())
    except (ImportError, OSError, ValueError):
        return None


def _groups(controller: str) -> list[Path]:
    """Folders of the control groups that this process is in, with those around them; of version 2 and 1."""
    try:
        lines = (_PROC / "self" / "cgroup").read_text().splitlines()
    except OSError:
        return []
    found: list[Path] = []
    for line in lines:
        _, controllers, path = [*line.split(":", 2), "", ""][:3]
        if controllers and controller not in controllers.split(","):
            continue
        root = _CGROUPS / controllers if controllers else _CGROUPS
        inner = root / path.lstrip("/")
        # Inside a container the path may be that outside, of which only the root is there.
        found += [root, *(each for each in (inner, *inner.parents) if root in each.parents)]
    return [folder for folder in found if folder.is_dir()]


def _cpu_share(folder: Path) -> float | None:
    """Cores that a group may take at once, as a number."""
    v2 = _words(folder / "cpu.max")
    words = v2 or _words(folder / "cpu.cfs_quota_us") + _words(folder / "cpu.cfs_period_us")
    try:
        quota, period = (float(word) for word in words[:2])
    except ValueError:  # "max", or nothing
        return None
    return quota / period if quota > 0 and period > 0 else None


def _free_of_group(folder: Path) -> int | None:
    """Bytes that a group may still take; files that are only kept in memory give way."""
    names = ("memory.max", "memory.current") if (folder / "memory.max").is_file() else _V1
    try:
        limit, used = (int(_words(folder / name)[0]) for name in names)
    except (IndexError, ValueError):  # "max", or nothing
        return None
    stat = dict(zip((words := _words(folder / "memory.stat"))[::2], words[1::2], strict=False))
    kept = int(stat.get("total_inactive_file", stat.get("inactive_file", "0")))
    return max(0, limit - used + kept)


def _words(file: Path) -> list[str]:
    try:
        return file.read_text("ascii").split()
    except (OSError, UnicodeDecodeError):
        return []


@contextmanager
def workers(
    count: int, prepare: Callable[[], None] | None = None
) -> Generator["ProcessPoolExecutor", None, None]:
    """So many processes with a thread each, which call ``prepare`` before their first job.

    They end at once where the work fails or is interrupted, or where this process is killed; what they write
    has to appear whole or not at all. Jobs that wait at the end are dropped.
    """
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    context = get_context("spawn")
    stopped = context.Event()
    pool = ProcessPoolExecutor(count, context, _begin, (os.getpid(), stopped, prepare))
    try:
        yield pool
    except BaseException:
        stopped.set()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(parent: int, stopped: "Event", prepare: Callable[[], None] | None) -> None:
    """What a worker does first."""
    import cv2

    cv2.setNumThreads(1)
    # Ctrl-C reaches all processes of a terminal; the one that was started decides.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_watch, args=(parent, stopped), daemon=True).start()
    if prepare is not None:
        prepare()


def _watch(parent: int, stopped: "Event") -> None:
    while os.getppid() == parent and not stopped.wait(_LOOKS_S):
        pass
    os._exit(1)
