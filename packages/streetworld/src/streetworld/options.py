"""Options of a drawn street."""

from dataclasses import dataclass
from typing import Literal

from dreamdrive.errors import InputError
from dreamdrive.scene.street.layout import BENCHMARK_EDITION

MOST_SECONDS = 60.0
"""Longest drive that is drawn: a street of a kilometre."""

StreetKind = Literal[
    "city", "town", "suburb", "avenue", "alley", "country", "motorway", "industrial", "parking"
]


@dataclass(frozen=True)
class StreetOptions:
    """What a drawn street has to be like; None leaves a choice to the seed.

    Speed is that of the recording car; movers and parked are numbers of road users; editions see
    ``scene.layout``. From edition 2 on a kind of street can be asked for, and a queue: the recording car
    moves slowly among large vehicles, in all lanes and oncoming, that fill most of its picture.
    """

    seconds: float = 2.4
    speed_m_s: float | None = None
    movers: int | None = None
    parked: int | None = None
    camera_height_m: float = 1.5
    edition: int = BENCHMARK_EDITION
    kind: StreetKind | None = None
    traffic: Literal["queue"] | None = None

    def check(self) -> None:
        """Raise unless such a street can be drawn."""
        if self.seconds <= 0 or min(self.speed_m_s or 0, self.movers or 0, self.parked or 0) < 0:
            raise ValueError(f"street: cannot draw {self}")
        if self.seconds > MOST_SECONDS:
            raise InputError(
                f"a drive of {self.seconds:g} s: streets are drawn for at most {MOST_SECONDS:g} s; ask for "
                "fewer frames, or give a layout of your own"
            )
