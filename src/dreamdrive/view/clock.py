"""The time of a browser: it stands or runs, and begins again at its end."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

SPEEDS = ("0.25", "0.5", "1", "2")
"""Times as fast as it was recorded, as the page offers them."""


@dataclass
class Clock:
    """Seconds on the clock of a scene, between its first and its last.

    Attributes:
        first_s: Where it begins.
        last_s: Where it ends.
        t_s: What it shows.
        playing: Whether it runs.
        speed: How many times as fast as it was recorded.
        now: Seconds that pass in the world.
    """

    first_s: float
    last_s: float
    t_s: float = field(default=float("nan"))
    playing: bool = False
    speed: float = 1.0
    now: Callable[[], float] = time.monotonic
    _told_s: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        self.set(self.first_s if self.t_s != self.t_s else self.t_s)

    def set(self, t_s: float) -> None:
        """Go to a time, within its bounds."""
        self.t_s, self._told_s = min(max(t_s, self.first_s), self.last_s), self.now()

    def span(self, first_s: float, last_s: float) -> None:
        """Other bounds."""
        self.first_s, self.last_s = first_s, last_s
        self.set(self.t_s)

    def play(self) -> None:
        """Run, from the start where it is at its end."""
        if self.t_s >= self.last_s:
            self.set(self.first_s)
        self.playing, self._told_s = True, self.now()

    def pause(self) -> None:
        """Stand."""
        self.playing = False

    def tick(self) -> float:
        """Go on by what passed in the world since it was told last, and tell."""
        now = self.now()
        if self.playing and self.last_s > self.first_s:
            gone_s = self.t_s - self.first_s + self.speed * (now - self._told_s)
            self.t_s = self.first_s + gone_s % (self.last_s - self.first_s)
        self._told_s = now
        return self.t_s
