"""The frames that a run will work on, told before its input is read."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Planned:
    """What a run will work on: frames of each camera, from ``start`` in the source on, ``step`` apart.

    The rate is that of the source, None where it is not known; ``chosen`` tells that somebody chose the
    frames.
    """

    frames: int
    cameras: int
    size: tuple[int, int]
    rate_hz: float | None
    start: int
    step: int
    chosen: bool

    @property
    def megapixels(self) -> float:
        """Of one frame."""
        return self.size[0] * self.size[1] / 1e6
