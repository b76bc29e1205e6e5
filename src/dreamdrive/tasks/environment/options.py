"""Options of an environment."""

import math
from dataclasses import dataclass, field

from dreamdrive.errors import InputError
from dreamdrive.tasks.environment.bicycle import EgoOptions
from dreamdrive.tasks.environment.pictures import PictureOptions
from dreamdrive.tasks.environment.reward import RewardOptions
from dreamdrive.tasks.environment.traffic import TrafficOptions

_MOST = 1e4


@dataclass(frozen=True)
class StartOptions:
    """How episodes begin; each number is drawn evenly.

    Attributes:
        share: The earliest and the latest start, as shares of the recorded time.
        aside_m: Most to the left or right of the recorded place.
        turned_rad: Most to the left or right of where the path points.
        speed: The lowest and the highest speed, as shares of the recorded one.
    """

    share: tuple[float, float] = (0.0, 0.5)
    aside_m: float = 0.5
    turned_rad: float = 0.05
    speed: tuple[float, float] = (0.8, 1.2)

    def __post_init__(self) -> None:
        if not 0 <= self.share[0] <= self.share[1] <= 1:
            raise InputError(f"share {self.share}; expected two rising shares of the recorded time, 0 to 1")
        if not 0 <= self.speed[0] <= self.speed[1] < math.inf:
            raise InputError(f"speed {self.speed}; expected two rising shares of the recorded speed")
        if not 0 <= self.aside_m < math.inf or not 0 <= self.turned_rad < math.pi / 2:
            raise InputError(f"{self}; expected aside_m of 0 or more, turned_rad less than a right angle")


@dataclass(frozen=True)
class EnvironmentOptions:
    """How an environment drives, ends and counts.

    Attributes:
        step_s: Time of a step.
        max_steps: Most steps of an episode; None has no such limit.
        beyond_s: How long an episode goes on after the recorded time. Then what moved at the end moves on at
            a constant rate; nothing else is known.
        beyond_m: How far behind the end of the recorded path it ends: what lies there was seen from afar.
        off_path_m: How far from the recorded path a car is off the road, where no map tells. Views hold up
            to about a lane's width aside.
        road_margin_m: How far a corner of the car may be outside of the road of a map.
        keep: How many scenes are kept in memory.
        trust: Whether ``info`` has ``expected_psnr_db``, the PSNR to expect of the first camera's picture; it
            takes longer than the picture.
        ego: The own car.
        start: How episodes begin.
        reward: Weights.
        traffic: How road users react, where they do.
        pictures: How pictures are drawn.
    """

    step_s: float = 0.1
    max_steps: int | None = None
    beyond_s: float = 0.0
    beyond_m: float = 20.0
    off_path_m: float = 4.0
    road_margin_m: float = 0.5
    keep: int = 4
    trust: bool = False
    ego: EgoOptions = field(default_factory=EgoOptions)
    start: StartOptions = field(default_factory=StartOptions)
    reward: RewardOptions = field(default_factory=RewardOptions)
    traffic: TrafficOptions = field(default_factory=TrafficOptions)
    pictures: PictureOptions = field(default_factory=PictureOptions)

    def __post_init__(self) -> None:
        if not 0.001 <= self.step_s <= 1:
            raise InputError(f"step_s {self.step_s:g}; expected 0.001 to 1 s")
        if self.max_steps is not None and self.max_steps < 2:
            raise InputError(f"max_steps {self.max_steps}; expected 2 or more, or None")
        lengths = self.beyond_s, self.beyond_m, self.off_path_m, self.road_margin_m
        if not all(0 <= each <= _MOST for each in lengths) or self.keep < 1:
            raise InputError(
                f"{lengths}, keep {self.keep}; expected 0 to {_MOST:g}, and to keep 1 scene at least"
            )
