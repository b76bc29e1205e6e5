"""How work tells those who wait how far it is."""

from collections.abc import Callable

Progress = Callable[[int, int], None]
"""Called with steps done and steps in all."""

StageProgress = Callable[[str, int, int], None]
"""Called with a stage's name, steps done and steps in all; 0 in all where a stage cannot count its steps."""


def silent(done: int, total: int) -> None:
    """Progress that nobody watches."""
