"""Threads and instruction set of the compiled core."""

from dreamdrive import _native


def set_threads(count: int) -> None:
    """Let the compiled core use ``count`` threads (at least 1). Results do not depend on it."""
    _native.set_threads(count)


def threads() -> int:
    """Threads the compiled core uses; at first as many as cores this process may run on."""
    return _native.threads()


def native_info() -> dict[str, str | int]:
    """Instruction set in use (baseline, avx2 or avx512) and number of threads.

    The environment variable ``DREAMDRIVE_ISA`` overrides the instruction set; it is read once.
    """
    return {"isa": _native.isa(), "threads": _native.threads()}


def stage_seconds() -> dict[str, float]:
    """Seconds of each stage of the last render by the compiled core, and of the last gradients."""
    return _native.stage_seconds()
