"""How long a training may take, and how far it is, told while it goes."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from dreamdrive_bench.gpu.figures import Figures

_SAID_EACH_S = 5.0
SAVING_S = 20.0
"""What the end of a training takes."""
_SURE = 0.85
"""Share of the rest that is filled with steps."""


@dataclass(frozen=True)
class Limit:
    """So many seconds from now on."""

    seconds: float
    begin: float = field(default_factory=time.monotonic)

    @property
    def spent_s(self) -> float:
        """Seconds since it was made."""
        return time.monotonic() - self.begin

    @property
    def left_s(self) -> float:
        """Seconds that are left, below 0 where it is over."""
        return self.seconds - self.spent_s


@dataclass
class Pace:
    """Puts steps done, steps a second and what else is known into figures, every few seconds.

    Attributes:
        figures: Where it goes, under ``name``.
        name: Of the training.
        more: What else is known, such as losses; asked each time.
        each_s: Seconds between two times.
    """

    figures: Figures
    name: str
    more: Callable[[], dict[str, Any]] = dict
    each_s: float = _SAID_EACH_S
    _first: tuple[int, float] | None = None
    _said_s: float = float("-inf")

    @property
    def per_second(self) -> float | None:
        """Steps a second since the first call; None before the second."""
        told = self.figures.values.get(self.name, {}).get("steps_per_second")
        return None if told is None else float(told)

    def __call__(self, done: int, total: int) -> None:
        """Take note of steps done."""
        now = time.monotonic()
        if self._first is None:
            self._first = done, now
        if now - self._said_s < self.each_s and done < total:
            return
        self._said_s = now
        first, since = self._first
        rate = (done - first) / (now - since) if done > first else None
        told = {"steps": done, "of": total, "steps_per_second": rate}
        self.figures.put(self.name, told | self.more())


def steps_that_fit(times_s: Sequence[float], limit: Limit) -> int:
    """How many steps fit into what is left, from the times of some; the later half of them counts."""
    later = times_s[len(times_s) // 2 :]
    per_second = (len(later) - 1) / (later[-1] - later[0])
    return max(1, int(_SURE * per_second * (limit.left_s - SAVING_S)))
