"""What this machine offers: cores, memory, and processes that work beside this one."""

import os
import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing.synchronize import Event

    import torch

_LOOKS_S = 0.5


def available_cores() -> int:
    """Cores this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def free_bytes(device: "torch.device | None" = None) -> int | None:
    """Memory that programs may still take, here or on a GPU; None where the system does not tell."""
    if device is not None and device.type == "cuda":
        import torch

        return torch.cuda.mem_get_info(device)[0]
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            lines = dict(line.split(":", 1) for line in file)
        return int(lines["MemAvailable"].split()[0]) * 1024
    except (OSError, KeyError, ValueError):
        return None


@contextmanager
def workers(count: int) -> Generator["ProcessPoolExecutor", None, None]:
    """So many processes with a thread each.

    They end at once where the work fails or is interrupted, or where this process is killed; what they write
    has to appear whole or not at all. Jobs that wait at the end are dropped.
    """
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    context = get_context("spawn")
    stopped = context.Event()
    pool = ProcessPoolExecutor(count, context, _begin, (os.getpid(), stopped))
    try:
        yield pool
    except BaseException:
        stopped.set()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(parent: int, stopped: "Event") -> None:
    """What a worker does first."""
    import cv2

    cv2.setNumThreads(1)
    # Ctrl-C reaches all processes of a terminal; the one that was started decides.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_watch, args=(parent, stopped), daemon=True).start()


def _watch(parent: int, stopped: "Event") -> None:
    while os.getppid() == parent and not stopped.wait(_LOOKS_S):
        pass
    os._exit(1)
