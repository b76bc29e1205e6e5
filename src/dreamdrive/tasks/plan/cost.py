"""UniAD's cost of a plan: how far its waypoints are moved, and how near they come to what is taken."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan.footprint import CAR, Footprint

_ROOT = 2.507
"""UniAD's root of 2 pi, to three digits."""


@dataclass(frozen=True)
class CollisionOptions:
    """What is minimised, and when.

    The cost was tuned for one point in each cell of 0.5 m: it is a sum over points, and grows with their
    density.

    Attributes:
        sigma_m: How far a point reaches.
        alpha: How strongly it pushes.
        radius_m: Points at this distance from a waypoint or farther have no part in it.
        whole_metres: Coordinates of points are cut to whole metres towards zero, as UniAD's program does,
            because it writes them into integers: up to 0.75 m each. Only for comparing with its numbers.
        always: Optimise all plans, as UniAD does; else those alone that come to lie on what is taken.
        margin_m: Added to the car on every side when that is asked. 0.5 m as in Agent-Driver's check.
        footprint: The car.
    """

    sigma_m: float = 1.0
    alpha: float = 5.0
    radius_m: float = 5.0
    whole_metres: bool = False
    always: bool = False
    margin_m: float = 0.5
    footprint: Footprint = CAR

    def __post_init__(self) -> None:
        sizes = self.sigma_m, self.radius_m
        if not all(0 < size < np.inf for size in sizes) or not 0 <= self.alpha < np.inf:
            raise InputError(f"{self}; expected sigma_m and radius_m above 0, and alpha of 0 or more")
        if not 0 <= self.margin_m < np.inf:
            raise InputError(f"margin_m {self.margin_m}; expected 0 metres or more")

    @property
    def weight(self) -> float:
        """Of the sum over points."""
        return self.alpha / (_ROOT * self.sigma_m)


CONDITIONAL = CollisionOptions()
"""UniAD's values on true centres, for plans that hit something."""
UNIAD = CollisionOptions(whole_metres=True, always=True)
"""As UniAD's program does it."""
AGENT_DRIVER = CollisionOptions(sigma_m=1.265, alpha=7.89)
"""The values that GPT-Driver's authors tuned for Agent-Driver, and their condition; it cuts no points."""


@dataclass(frozen=True)
class Surroundings:
    """Points near N waypoints, all in one list.

    Attributes:
        places_m: (M, 2).
        waypoint: Which waypoint each belongs to (M,).
    """

    places_m: Float[np.ndarray, "m 2"]
    waypoint: Int[np.ndarray, " m"]

    def counts(self, waypoints: int) -> Int[np.ndarray, " n"]:
        """Points of each waypoint."""
        return np.bincount(self.waypoint, minlength=waypoints)

    def of(self, waypoints: Bool[np.ndarray, " n"]) -> "Surroundings":
        """The points of some waypoints, which are counted anew."""
        kept = waypoints[self.waypoint]
        numbers = np.cumsum(waypoints) - 1
        return Surroundings(self.places_m[kept], numbers[self.waypoint[kept]])


def cost_of(
    waypoints_m: Float[np.ndarray, "n 2"],
    reference_m: Float[np.ndarray, "n 2"],
    near: Surroundings,
    options: CollisionOptions,
) -> Float[np.ndarray, " n"]:
    """Cost of each waypoint in square metres: squared way from its reference, and the push of its points."""
    _, pushes = _pushes(waypoints_m, near, options)
    return np.square(waypoints_m - reference_m).sum(-1) + _summed(pushes, near, len(waypoints_m))


def slopes_of(
    waypoints_m: Float[np.ndarray, "n 2"],
    reference_m: Float[np.ndarray, "n 2"],
    near: Surroundings,
    options: CollisionOptions,
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 2"]]:
    """Gradient and Hessian of ``cost_of`` for each waypoint by itself."""
    count, variance = len(waypoints_m), options.sigma_m**2
    away, pushes = _pushes(waypoints_m, near, options)
    pulled = pushes / variance
    gradient = 2.0 * (waypoints_m - reference_m)
    hessian = np.zeros((count, 2, 2))
    total = _summed(pulled, near, count)
    for i in range(2):
        gradient[:, i] -= _summed(pulled * away[:, i], near, count)
        hessian[:, i, i] = 2.0 - total
        for j in range(2):
            hessian[:, i, j] += _summed(pulled / variance * away[:, i] * away[:, j], near, count)
    return gradient, hessian


def _pushes(
    waypoints_m: Float[np.ndarray, "n 2"], near: Surroundings, options: CollisionOptions
) -> tuple[Float[np.ndarray, "m 2"], Float[np.ndarray, " m"]]:
    """From each point to its waypoint, and its part of the cost."""
    away = waypoints_m[near.waypoint] - near.places_m
    return away, options.weight * np.exp(-np.square(away).sum(-1) / (2 * options.sigma_m**2))


def _summed(values: Float[np.ndarray, " m"], near: Surroundings, waypoints: int) -> Float[np.ndarray, " n"]:
    # Without any point it counts whole numbers.
    return np.bincount(near.waypoint, weights=values, minlength=waypoints).astype(np.float64, copy=False)
