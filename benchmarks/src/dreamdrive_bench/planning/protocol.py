"""The committed protocol of the planning experiment, as typed values."""

from functools import cache
from pathlib import Path
from typing import Literal, get_args

import msgspec
import numpy as np
from jaxtyping import Float

PROTOCOL = Path(__file__).with_name("protocol.json")

Kind = Literal["stopped", "slowing", "crossing", "walking", "cut_in", "parked", "clear"]
KINDS: tuple[Kind, ...] = get_args(Kind)
"""What happens ahead of the car: see ``conflicts``."""


class Group(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Scenarios of one kind; each has a seed of its own."""

    kind: Kind
    first_seed: int
    count: int

    @property
    def seeds(self) -> range:
        """The seeds of its scenarios."""
        return range(self.first_seed, self.first_seed + self.count)


class Protocol(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All of it. The last frame that is seen is the instant of planning."""

    about: str
    edition: int
    frames: int
    rate_hz: float
    width_px: int
    height_px: int
    quality: str
    horizon_s: float
    step_s: float
    after_s: float
    development: tuple[Group, ...]
    test: tuple[Group, ...]

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of the frames."""
        return self.width_px, self.height_px

    @property
    def frame_times_s(self) -> Float[np.ndarray, " f"]:
        """When the frames are taken; the first at 0."""
        return np.arange(self.frames) / self.rate_hz

    @property
    def instant_s(self) -> float:
        """When the planner plans."""
        return (self.frames - 1) / self.rate_hz

    @property
    def end_s(self) -> float:
        """Until when all road users are known."""
        return self.instant_s + self.horizon_s + self.after_s


@cache
def read_protocol(path: Path = PROTOCOL) -> Protocol:
    """The protocol of a file."""
    return msgspec.json.decode(path.read_bytes(), type=Protocol)
