"""The reward of a step."""

import math
from dataclasses import dataclass

from dreamdrive.errors import InputError
from dreamdrive.tasks.environment.bicycle import EgoOptions, EgoState
from dreamdrive.tasks.environment.path import OnPath


@dataclass(frozen=True)
class RewardOptions:
    """Weights of the terms, each of which is 0 or more.

    Attributes:
        progress: Of a metre along the recorded path.
        aside: Of a metre beside it, for a second.
        comfort: Of one (m/s^2)^2 of acceleration, along and aside, for a second.
        collision: Once.
        off_road: Once.
    """

    progress: float = 1.0
    aside: float = 1.0
    comfort: float = 0.05
    collision: float = 50.0
    off_road: float = 50.0

    def __post_init__(self) -> None:
        if not all(0 <= each < math.inf for each in vars(self).values()):
            raise InputError(f"{self}; expected finite weights of 0 or more")


@dataclass(frozen=True)
class Reward:
    """The terms of a step; what costs is below 0."""

    progress: float
    aside: float
    comfort: float
    collision: float
    off_road: float

    @property
    def total(self) -> float:
        """Their sum."""
        return self.progress + self.aside + self.comfort + self.collision + self.off_road


def reward_of(
    before: OnPath,
    after: OnPath,
    state: EgoState,
    hit: bool,
    off_road: bool,
    step_s: float,
    ego: EgoOptions,
    weights: RewardOptions,
) -> Reward:
    """The terms of a step.

    Args:
        before: Where the car was by the path.
        after: Where it is.
        state: What it does now.
        hit: Whether it lies on something.
        off_road: Whether it left the road.
        step_s: Length of the step.
        ego: The car.
        weights: Of the terms.
    """
    across_m_s2 = state.speed_m_s * state.yaw_rate_rad_s(ego)
    return Reward(
        progress=weights.progress * (after.along_m - before.along_m),
        aside=-weights.aside * abs(after.aside_m) * step_s,
        comfort=-weights.comfort * (state.acceleration_m_s2**2 + across_m_s2**2) * step_s,
        collision=-weights.collision * hit,
        off_road=-weights.off_road * off_road,
    )
