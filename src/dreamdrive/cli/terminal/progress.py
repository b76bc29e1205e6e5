"""Progress of the stages in the terminal."""

import time

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn as TimeLeftColumn,
)


class Bars:
    """One bar a stage with the time left; a line a stage where the output is no terminal.

    Use as a context manager; the object itself is what ``pipeline.generate`` calls.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bars = Progress(
            TextColumn("{task.description:<11}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("elapsed"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeLeftColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self._tasks: dict[str, TaskID] = {}
        self._started: dict[str, float] = {}

    def __enter__(self) -> "Bars":
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bars.stop()

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Show that a stage has done so much; a total of 0 means that it cannot be counted."""
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=None)
            self._started[stage] = time.perf_counter()
        self._bars.update(self._tasks[stage], completed=done, total=total or None)
        if total and done >= total and stage in self._started and not self._console.is_terminal:
            self._console.print(f"{stage}: {time.perf_counter() - self._started.pop(stage):.1f} s")
