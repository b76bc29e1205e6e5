"""Use of the machine by commands: all cores, and signals that end the work."""

import os
import signal
import sys
import time
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType

from dreamdrive.compute.machine import available_cores

STARTED_S = time.perf_counter()
"""When the command was, but for a tenth of a second that Python takes."""
_ENDS = (signal.SIGTERM, signal.SIGHUP)
_AGAIN_S = 0.01
_asked: list[int] = []


def use_all_cores() -> None:
    """Let torch and the native core use every core of this process; to be called before torch is imported."""
    # By default threads that wait keep their core busy: beside other work a fit takes three times as long.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    import torch

    from dreamdrive.splat import set_threads

    torch.set_num_threads(available_cores())
    set_threads(available_cores())


class Terminated(KeyboardInterrupt):
    """Asked to terminate, or left by its terminal (``_ENDS``), which ends the work as Ctrl-C does."""


def stop_like_an_interruption() -> None:
    """Let a request to terminate, or a terminal that goes away, end the work as Ctrl-C does."""

    def stop(number: int, frame: FrameType | None) -> None:
        _asked.append(number)
        raise _end_of(number)

    for number in _ends():
        signal.signal(number, stop)
    if signal.getsignal(signal.SIGINT) == signal.default_int_handler:
        signal.signal(signal.SIGINT, stop)
    _raise_again_what_is_ignored()


def _raise_again_what_is_ignored() -> None:
    """Where Python cannot raise, as while it frees what nobody holds, it prints the error and goes on."""

    def again(number: int, frame: FrameType | None) -> None:
        if _asked:
            raise _end_of(_asked[-1])

    def hook(ignored: "sys.UnraisableHookArgs") -> None:
        if issubclass(ignored.exc_type, KeyboardInterrupt) and _asked:
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        else:
            sys.__unraisablehook__(ignored)

    signal.signal(signal.SIGALRM, again)
    sys.unraisablehook = hook


def _end_of(number: int) -> KeyboardInterrupt:
    """What is raised when a signal asks to end."""
    return KeyboardInterrupt() if number == signal.SIGINT else Terminated()


def asked_to_end() -> "KeyboardInterrupt | None":
    """What was raised as somebody asked the command to end, whatever a library made of it; told once."""
    last, _asked[:] = _asked[-1:], []
    return _end_of(last[0]) if last else None


def _ends() -> list[signal.Signals]:
    """Signals that ask to terminate; under nohup the terminal may go away."""
    return [
        number for number in _ENDS if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN
    ]


class Stop:
    """Whether somebody asked to stop; the work then ends at its next safe point."""

    def __init__(self) -> None:
        self._signal = 0

    def __call__(self) -> bool:
        """Whether the work shall end."""
        return self._signal != 0

    def ask(self, number: int, frame: FrameType | None = None) -> None:
        """Remember a signal; a second one ends the work at once."""
        if self._signal:
            self.end()
        self._signal = number

    def end(self) -> None:
        """End the command as its signal would have."""
        raise _end_of(self._signal)


@contextmanager
def asked_to_stop() -> Generator[Stop, None, None]:
    """Take Ctrl-C and requests to terminate as requests to stop at the next safe point."""
    stop = Stop()
    before = {number: signal.signal(number, stop.ask) for number in (signal.SIGINT, *_ends())}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
