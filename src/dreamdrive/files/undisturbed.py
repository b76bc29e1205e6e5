"""Work that is not interrupted between making something and taking it away again."""

import signal
import threading
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from types import FrameType
from typing import TypeVar

T = TypeVar("T")
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def undisturbed() -> Generator[None, None, None]:
    """Let signals that ask to end wait until this is over; they come to the main thread alone."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[tuple[int, FrameType | None]] = []

    def wait(number: int, frame: FrameType | None) -> None:
        came.append((number, frame))

    handlers = {number: signal.getsignal(number) for number in _SIGNALS}
    handlers = {number: handler for number, handler in handlers.items() if callable(handler)}
    try:
        for number in handlers:
            signal.signal(number, wait)
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number, frame in came[:1]:
            handlers[signal.Signals(number)](number, frame)


@contextmanager
def held(enter: Callable[[ExitStack], T]) -> Generator[T, None, None]:
    """What ``enter`` puts onto a stack, which is taken away again; neither is interrupted halfway."""
    stack = ExitStack()
    try:
        with undisturbed():
            value = enter(stack)
        yield value
    finally:
        with undisturbed():
            stack.close()
