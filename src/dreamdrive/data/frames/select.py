"""Selection of frames: which are read, and which of those are held out."""

import re
import sys
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from dreamdrive.errors import InputError

UNBOUNDED = sys.maxsize
"""Stop of a selection that runs to the end of a source whose length is not known yet."""

MAX_FRAMES = 1000
"""Frames a clip may have: all are in memory, 0.4 MB each at 480x270, and every stage adds its own."""
SPARSEST_S = 0.5
"""Frames further apart show too little of the same street: the key frames of nuScenes are as far apart."""

_PATTERN = re.compile(r"\s*(-?\d+)?\s*:\s*(-?\d+)?\s*(?::\s*(-?\d+)?\s*)?")


@dataclass(frozen=True)
class Selection:
    """``START:STOP:STEP`` over source indices, as a Python slice with a positive step.

    Negative numbers count from the end; without ``stop`` it is the end.
    """

    start: int = 0
    stop: int | None = None
    step: int = 1

    @staticmethod
    def parse(text: str | None) -> "Selection":
        """Read ``START:STOP:STEP``, each part optional; ``None`` selects everything."""
        if text is None:
            return Selection()
        match = _PATTERN.fullmatch(text)
        if match is None:
            raise InputError(f"--frames {text}: expected START:STOP or START:STOP:STEP, such as 0:48:2")
        start, stop, step = (None if part is None else int(part) for part in match.groups())
        if step is not None and step < 1:
            raise InputError(
                f"--frames {text}: the step is {step}; frames are read forwards, so give 1 or more"
            )
        return Selection(start or 0, stop, 1 if step is None else step)

    def __str__(self) -> str:
        return f"{self.start}:{'' if self.stop is None else self.stop}:{self.step}"

    @property
    def is_whole(self) -> bool:
        """Whether nobody chose among the frames."""
        return self == Selection()

    @property
    def needs_count(self) -> bool:
        """Whether the length of the source must be known to tell which frames are meant."""
        return self.start < 0 or (self.stop is not None and self.stop < 0)

    def resolve(self, count: int | None, name: str) -> range:
        """The selected indices of ``count`` frames, which may be unknown unless ``needs_count``."""
        if count is None:
            if self.needs_count:
                raise ValueError(f"{self} cannot be resolved without the number of frames")
            wanted = range(self.start, UNBOUNDED if self.stop is None else self.stop, self.step)
        elif self.stop is not None and self.stop >= 0 and self.start >= 0:
            wanted = range(self.start, self.stop, self.step)
        else:
            wanted = range(count)[self.start : self.stop : self.step]
        if count is not None and self.stop is None and self.start >= count:
            raise InputError(
                f"--frames {self} selects no frame: {name} has {count} frames (0 to {count - 1})"
            )
        if not wanted:
            raise InputError(f"--frames {self} selects no frame; expected START below STOP")
        if count is not None and wanted[-1] >= count:
            raise out_of_range(wanted[-1], count, name)
        return wanted


def thinning(count: int, rate_hz: float, most: int) -> int:
    """The step 1, 2, 4, ... that leaves ``most`` of ``count`` frames at most; 1 where that is too sparse."""
    step = 1
    while count > most * step:
        step *= 2
    return step if step <= rate_hz * SPARSEST_S else 1


def of_thinning(step: int) -> tuple[str, ...]:
    """The sentence about frames that were left out since there are too many."""
    if step == 1:
        return ()
    which = "second" if step == 2 else f"{step}th"
    return (
        f"There are more than {MAX_FRAMES} frames: every {which} one is taken. Choose others with --frames.",
    )


def out_of_range(index: int, count: int, name: str) -> InputError:
    """The error for a selected frame that the source does not have."""
    return InputError(
        f"--frames asks for frame {index}, but {name} has only {count} frames (0 to {count - 1}); "
        f"choose STOP at most {count}"
    )


def held_out_mask(count: int, every: int | None) -> Bool[np.ndarray, " f"]:
    """Which of ``count`` selected frames are held out: i mod N = N // 2, never the first or the last."""
    index = np.arange(count)
    if every is None:
        return np.zeros(count, dtype=bool)
    if every < 2:
        raise InputError(f"--hold-out {every}: expected 2 or more (8 withholds every eighth frame)")
    mask = (index % every == every // 2) & (index > 0) & (index < count - 1)
    if not mask.any():
        raise InputError(
            f"--hold-out {every} withholds nothing of {count} frames; "
            f"give at least {every // 2 + 2} frames or a smaller number"
        )
    return mask
