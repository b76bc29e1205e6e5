"""What a video model is told to do: the kinds of action of Vista, in SI units.

Frame of the car: x to the right, z ahead, metres, from where the camera is at the first frame.
"""

from dataclasses import dataclass
from typing import Literal

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
    """Where to be at ``AT_S``.

    Attributes:
        right_m: Distances to the right; left is negative.
        ahead_m: Distances ahead.
    """

    right_m: Four
    ahead_m: Four


@dataclass(frozen=True)
class Steering:
    """Speed and steering wheel at ``AT_S``.

    Attributes:
        speed_m_s: Speeds, forward.
        wheel_rad: Angles of the steering wheel (not of the road wheels); to the left is positive.
    """

    speed_m_s: Four
    wheel_rad: Four


@dataclass(frozen=True)
class Goal:
    """A point of the first frame to drive to, as shares of its width and height from the top left."""

    column: float
    row: float


Action = Command | Waypoints | Steering | Goal
