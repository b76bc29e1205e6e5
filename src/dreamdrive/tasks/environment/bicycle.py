"""The own car as a kinematic bicycle."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError

_LEAST, _MOST = 1e-3, 1e6
_STRAIGHT_RAD = 1e-9
"""Turn of a step below which its arc is a line."""


@dataclass(frozen=True)
class EgoOptions:
    """The own car; sizes by default are those of the cars of nuScenes.

    Attributes:
        length_m: Of its rectangle.
        width_m: Of its rectangle.
        wheelbase_m: Between the axles.
        middle_ahead_m: How far the middle of the rectangle is ahead of the rear axle.
        camera_ahead_m: How far the camera that recorded is ahead of the rear axle.
        accelerate_m_s2: What action 1 does.
        brake_m_s2: What action -1 does.
        top_speed_m_s: It drives no faster, and never backwards.
        steer_rad: Most that the front wheels turn.
        steer_rad_s: How fast they turn.
        lateral_m_s2: Most acceleration aside: at speed the wheels turn less.
    """

    length_m: float = 4.084
    width_m: float = 1.85
    wheelbase_m: float = 2.588
    middle_ahead_m: float = 1.385
    camera_ahead_m: float = 1.7
    accelerate_m_s2: float = 3.0
    brake_m_s2: float = 6.0
    top_speed_m_s: float = 25.0
    steer_rad: float = 0.55
    steer_rad_s: float = 0.7
    lateral_m_s2: float = 7.0

    def __post_init__(self) -> None:
        places = self.middle_ahead_m, self.camera_ahead_m
        others = [value for name, value in vars(self).items() if not name.endswith("ahead_m")]
        if not all(_LEAST <= each <= _MOST for each in others) or not all(
            abs(each) <= _MOST for each in places
        ):
            raise InputError(f"{self} is no car; expected sizes and limits from {_LEAST:g} to {_MOST:g}")
        if self.steer_rad >= math.pi / 2:
            raise InputError(f"steer_rad {self.steer_rad:g}; expected less than a right angle")


@dataclass(frozen=True)
class EgoState:
    """Where the own car is: the middle of its rear axle on the level ground, and what it does.

    Attributes:
        x_m: In the level frame of the scene.
        y_m: The same.
        yaw_rad: From x counter-clockwise; it counts on beyond a whole turn.
        speed_m_s: 0 or more.
        steer_rad: Of the front wheels, positive to the left.
        acceleration_m_s2: Of the step that led here.
    """

    x_m: float
    y_m: float
    yaw_rad: float
    speed_m_s: float
    steer_rad: float = 0.0
    acceleration_m_s2: float = 0.0

    def yaw_rate_rad_s(self, options: EgoOptions) -> float:
        """How fast it turns, positive to the left."""
        return self.speed_m_s * math.tan(self.steer_rad) / options.wheelbase_m

    def rectangle(self, options: EgoOptions) -> Float[np.ndarray, "5"]:
        """The ground that it covers: middle x and y, length, width, yaw."""
        x = self.x_m + options.middle_ahead_m * math.cos(self.yaw_rad)
        y = self.y_m + options.middle_ahead_m * math.sin(self.yaw_rad)
        return np.array([x, y, options.length_m, options.width_m, self.yaw_rad])


def driven(
    state: EgoState, acceleration: float, steering: float, step_s: float, options: EgoOptions
) -> EgoState:
    """The car after a step with both pedals and the steering wheel held.

    The wheels first turn as far as they can in a step; then the car drives an arc of constant curvature and
    acceleration, which is integrated exactly: a car that stops or reaches its top speed within the step, too.

    Args:
        state: Before the step.
        acceleration: From -1, full brakes, to 1.
        steering: From -1, all to the right, to 1.
        step_s: Length of the step.
        options: The car.
    """
    most = options.accelerate_m_s2 if acceleration > 0 else options.brake_m_s2
    way_m, speed_m_s = _way(state.speed_m_s, acceleration * most, step_s, options.top_speed_m_s)
    steer_rad = _steered(state, steering, step_s, options)
    turn_rad = way_m * math.tan(steer_rad) / options.wheelbase_m
    half = turn_rad / 2
    chord_m = way_m * (1.0 if abs(half) < _STRAIGHT_RAD else math.sin(half) / half)
    return EgoState(
        x_m=state.x_m + chord_m * math.cos(state.yaw_rad + half),
        y_m=state.y_m + chord_m * math.sin(state.yaw_rad + half),
        yaw_rad=state.yaw_rad + turn_rad,
        speed_m_s=speed_m_s,
        steer_rad=steer_rad,
        acceleration_m_s2=(speed_m_s - state.speed_m_s) / step_s,
    )


def _way(speed_m_s: float, acceleration_m_s2: float, step_s: float, top_m_s: float) -> tuple[float, float]:
    """Metres of a step and the speed after it, which stays between 0 and the top speed."""
    if acceleration_m_s2 == 0:
        return speed_m_s * step_s, speed_m_s
    reached = min(max(speed_m_s + acceleration_m_s2 * step_s, 0.0), max(top_m_s, speed_m_s))
    changing_s = (reached - speed_m_s) / acceleration_m_s2
    return (speed_m_s + reached) / 2 * changing_s + reached * (step_s - changing_s), reached


def _steered(state: EgoState, steering: float, step_s: float, options: EgoOptions) -> float:
    """The angle of the wheels in a step: no faster than they turn, no more than the tyres hold."""
    # Of a speed near 0 the square may be 0.
    held_rad = math.atan2(options.lateral_m_s2 * options.wheelbase_m, state.speed_m_s**2)
    most = min(options.steer_rad, held_rad)
    turned = options.steer_rad_s * step_s
    wanted = min(max(steering * options.steer_rad, state.steer_rad - turned), state.steer_rad + turned)
    return min(max(wanted, -most), most)
