"""A run of the stages whose results are looked into."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from dreamdrive.progress import Work, trusted

T = TypeVar("T")


@dataclass
class Recorder:
    """A ``Run`` that keeps results in memory, and how long each stage took."""

    results: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    def __call__(
        self,
        name: str,
        options: object,
        compute: Callable[[Work], T],
        *,
        check: Callable[[T], None] = trusted,
        given: T | None = None,
    ) -> T:
        """See ``Run``."""
        began = time.perf_counter()
        value = compute(Work()) if given is None else given
        self.results[name], self.seconds[name] = value, time.perf_counter() - began
        return value
