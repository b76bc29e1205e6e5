"""What a video model is told to do: the kinds of action of Vista, in SI units.

Frame of the car: x to the right, z ahead, metres, from where the camera is at the first frame.
"""

from dataclasses import dataclass
from typing import Literal

from dreamdrive.errors import InputError

AT_S = (0.5, 1.0, 1.5, 2.0)
"""When waypoints, speeds and wheel angles hold, from the first frame on."""

Four = tuple[float, float, float, float]
Direction = Literal["left", "right", "forward", "stop"]


@dataclass(frozen=True)
class Command:
    """Where to go, in a word."""

    direction: Direction


@dataclass(frozen=True)
class Waypoints:
    """Where to be at ``AT_S``: distances to the right, negative to the left, and ahead."""

    right_m: Four
    ahead_m: Four


@dataclass(frozen=True)
class Steering:
    """Forward speeds, and angles of the steering wheel (not the road wheels; left positive), at ``AT_S``."""

    speed_m_s: Four
    wheel_rad: Four


@dataclass(frozen=True)
class Goal:
    """A point of the first frame to drive to, as shares of its width and height from the top left."""

    column: float
    row: float


Action = Command | Waypoints | Steering | Goal

RANGES: dict[str, tuple[float, float]] = {
    "right_m": (-30.0, 30.0),
    "ahead_m": (-1.0, 100.0),
    "speed_m_s": (0.0, 50.0),
    "wheel_rad": (-13.7, 13.7),
    "column": (0.0, 1.0),
    "row": (0.0, 1.0),
}
"""What a car on a road does within two seconds; the wheel's is that of nuScenes' CAN bus, 780 degrees."""


def check_action(action: Action) -> None:
    """Raise ``InputError`` where no car could do it: a number is outside ``RANGES``."""
    if isinstance(action, Command):
        return
    for name, values in vars(action).items():
        least, most = RANGES[name]
        for value in values if isinstance(values, tuple) else (values,):
            if not least <= value <= most:
                raise InputError(
                    f"an action outside its range: {name} is {value:g}; expected {least:g} to {most:g}"
                )
