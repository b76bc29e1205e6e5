"""One thread that draws for all browsers; of each only the latest wish is kept."""

import logging
import threading
import time
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

_log = logging.getLogger("dreamdrive")


@dataclass(frozen=True)
class _Wish:
    due_s: float
    draw: Callable[[], None]


@dataclass
class FrameLoop:
    """Draws what was asked for last, the longest waiting browser first.

    A wish in place of an older one keeps its turn. What fails is logged, and the thread goes on.
    """

    _wishes: dict[Hashable, _Wish] = field(default_factory=dict, init=False)
    _changed: threading.Condition = field(default_factory=threading.Condition, init=False)
    _open: bool = field(default=True, init=False)
    _thread: threading.Thread | None = field(default=None, init=False)

    def start(self) -> None:
        """Begin to draw."""
        self._thread = threading.Thread(target=self._run, name="frames", daemon=True)
        self._thread.start()

    def ask(self, who: Hashable, draw: Callable[[], None], after_s: float = 0.0) -> None:
        """Draw soon, or not before some time has passed, in place of what this one asked for until now."""
        with self._changed:
            due_s = time.monotonic() + after_s
            if who in self._wishes:
                due_s = min(due_s, max(self._wishes[who].due_s, time.monotonic())) if not after_s else due_s
            self._wishes[who] = _Wish(due_s, draw)
            self._changed.notify()

    def asks(self, who: Hashable) -> bool:
        """Whether somebody waits for a picture."""
        with self._changed:
            return who in self._wishes

    def drop(self, who: Hashable) -> None:
        """Forget what one asked for."""
        with self._changed:
            self._wishes.pop(who, None)

    def close(self) -> None:
        """Draw no more; what is being drawn is finished."""
        with self._changed:
            self._open = False
            self._changed.notify()
        if self._thread is not None:
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        with ThreadPoolExecutor(1) as pool:  # which hands on what is raised, whatever it is
            while (draw := self._next()) is not None:
                error = pool.submit(draw).exception()
                if error is not None:
                    _log.error("a picture could not be drawn", exc_info=error)

    def _next(self) -> Callable[[], None] | None:
        """What to draw now, when its time has come; None at the end."""
        with self._changed:
            while self._open:
                who = min(self._wishes, key=lambda each: self._wishes[each].due_s, default=None)
                wait_s = None if who is None else self._wishes[who].due_s - time.monotonic()
                if who is not None and wait_s is not None and wait_s <= 0:
                    return self._wishes.pop(who).draw
                self._changed.wait(wait_s)
        return None
