"""Progress of work, and parts of it that are kept."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar, runtime_checkable

T = TypeVar("T")

Progress = Callable[[int, int], None]
"""Called with steps done and steps in all."""

StageProgress = Callable[[str, int, int], None]
"""Called with a stage's name, steps done and steps in all; 0 in all where a stage cannot count its steps."""


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
