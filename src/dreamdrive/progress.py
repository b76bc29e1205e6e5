"""Progress of work, and parts of it that are kept."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar, runtime_checkable

from dreamdrive.errors import InputError

T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Called with steps done and steps in all."""

StageProgress = Callable[[str, int, int], None]
"""Called with a stage's name, steps done and steps in all; 0 in all where a stage cannot count its steps."""


_PAUSE_S = 0.2
"""Least time between two pictures of bars in a notebook."""


def silent(done: int, total: int) -> None:
    """Progress that nobody watches."""


@runtime_checkable
class Keep(Protocol):
    """Gives a part of a stage's result by its name: what an interrupted run left, or what it computes."""

    def __call__(self, name: str, compute: Callable[[], T], /) -> T:
        """The part."""
        ...


def at_once(name: str, compute: Callable[[], T]) -> T:
    """Keeps nothing."""
    return compute()


@dataclass(frozen=True)
class Work:
    """What a stage has beside its input; as a function it is a ``Progress``.

    Attributes:
        tell: Told of each step, by stages that can count them.
        keep: Where parts that took long are kept until the stage ends.
    """

    tell: Progress = silent
    keep: Keep = at_once

    def __call__(self, done: int, total: int) -> None:
        """Tell of steps."""
        self.tell(done, total)

    def part(self, index: int, count: int) -> "Work":
        """One of several equal parts of this work, counted from 0."""

        def tell(done: int, total: int) -> None:
            self.tell(index * total + done, count * total)

        def keep(name: str, compute: Callable[[], T]) -> T:
            return self.keep(f"{name}-{index}", compute)

        return Work(tell, keep)


def trusted(value: object) -> None:
    """No check."""


@runtime_checkable
class Run(Protocol):
    """What gives the result of a stage: ``call`` computes it, ``run.Stages`` keeps it on disk."""

    def __call__(
        self,
        name: str,
        options: object,
        compute: Callable[[Work], T],
        *,
        check: Callable[[T], None] = trusted,
        given: T | None = None,
    ) -> T:
        """The result of one of ``names.Stage``, unless it is given.

        It depends on the options and the results before it, nothing else; ``check`` raises ``ValueError``
        where a stored result does not belong to these.
        """
        ...


def call(
    name: str,
    options: object,
    compute: Callable[[Work], T],
    *,
    check: Callable[[T], None] = trusted,
    given: T | None = None,
) -> T:
    """A ``Run`` that keeps nothing."""
    return compute(Work()) if given is None else given


class NotebookBars:
    """Bars in a notebook, one a stage, with its seconds: a ``StageProgress``.

    Raises:
        InputError: IPython, which every notebook has, is not there.
    """

    def __init__(self) -> None:
        try:
            from IPython.display import HTML, display
        except ImportError:
            raise InputError(
                "NotebookBars: IPython is not installed, and only notebooks show these bars; "
                "expected dreamdrive[notebook]: .venv/bin/pip install -e '.[notebook]'"
            ) from None
        self._html, self._stages, self._shown_s = HTML, dict[str, tuple[float, int, int]](), 0.0
        self._place = display(HTML(""), display_id=True)

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Show that a stage has done so much; a total of 0 means that it cannot be counted."""
        now_s = time.perf_counter()
        is_new = stage not in self._stages
        self._stages[stage] = (now_s if is_new else self._stages[stage][0], done, total)
        if is_new or done >= total or now_s - self._shown_s > _PAUSE_S:
            self._shown_s = now_s
            rows = "".join(_bar(name, *values, now_s) for name, values in self._stages.items())
            if self._place is not None:  # outside notebooks nothing is shown
                self._place.update(self._html(f"<table>{rows}</table>"))


def _bar(stage: str, began_s: float, done: int, total: int, now_s: float) -> str:
    share = f'<progress max="{total}" value="{done}"></progress>' if total else "<progress></progress>"
    count = f"{done} of {total}" if total else ""
    return f"<tr><td>{stage}</td><td>{share}</td><td>{count}</td><td>{now_s - began_s:.0f} s</td></tr>"
