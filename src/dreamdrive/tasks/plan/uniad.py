"""UniAD's optimisation of plans: waypoints move away from what is taken and stay near where they were.

The cost is a sum over waypoints that do not depend on each other, so that each is a problem in two
dimensions. The published program gives them to IPOPT as one; Newton's method finds the same places.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.tasks.plan.cost import CONDITIONAL, CollisionOptions, Surroundings, cost_of, slopes_of
from dreamdrive.tasks.plan.footprint import Footprint
from dreamdrive.tasks.plan.grid import Occupancy
from dreamdrive.tasks.plan.rectangles import inside
from dreamdrive.tasks.plan.trajectory import STEP_S

_SETTLED = 1e-9
"""Slope of the cost in metres, beside the weight of the points, at which a waypoint is where it belongs."""
_MOST_STEPS, _HALVINGS = 200, 40
_LONGEST = 0.5
"""Step as a share of sigma. Amid dense traffic 1 % of waypoints end elsewhere than by steepest descent;
with whole sigmas 1.7 %, with a quarter 0.7 %, for a third more steps."""
_ENOUGH = 1e-4
"""Share of the expected gain that a step must bring."""
_FLATTEST = 1e-3
"""Least curvature that a step believes."""
_ROUNDING = 1e-14
"""Of a cost, relative to it."""


@dataclass(frozen=True)
class MovedPlans:
    """Plans after the optimisation.

    Attributes:
        waypoints_m: In the planning frame (B, T, 2).
        hits: At which steps the car, with the margin, covers the centre of a cell that is taken (B, T).
        chosen: Which plans took part: those with a hit, or all (B,).
        points: How many points take part at each step (B, T). Without any a waypoint stays as it is.
        cost_before: Of each plan in square metres, summed over its steps (B,).
        cost_after: The same of what came out.
    """

    waypoints_m: Float[np.ndarray, "b t 2"]
    hits: Bool[np.ndarray, "b t"]
    chosen: Bool[np.ndarray, " b"]
    points: Int[np.ndarray, "b t"]
    cost_before: Float[np.ndarray, " b"]
    cost_after: Float[np.ndarray, " b"]


def optimise_as_uniad(
    plans_m: Float[np.ndarray, "b t 2"],
    occupied: Sequence[Occupancy],
    options: CollisionOptions = CONDITIONAL,
    step_s: float = STEP_S,
) -> MovedPlans:
    """Move the waypoints of plans to where their cost is least, downhill from where they are.

    A waypoint on an axis of symmetry of its points stays on it: nothing says to which side it should go. The
    car is looked at where its waypoints are, not in between.

    Args:
        plans_m: Waypoints in the planning frame (B, T, 2); the first is one step after now.
        occupied: What is taken around each of the plans.
        options: What is minimised, and when.
        step_s: Time between waypoints.

    Raises:
        RuntimeError: The least cost was not found; it is not known to happen.
    """
    hits = covered(plans_m, occupied, options.footprint, options.margin_m, step_s)
    near = surroundings(plans_m, occupied, options, step_s)
    chosen = np.logical_or(hits.any(axis=1), options.always)
    count = plans_m.shape[0] * plans_m.shape[1]
    reference = plans_m.reshape(count, 2).astype(np.float64)
    moved, rows = reference.copy(), np.repeat(chosen, plans_m.shape[1])
    moved[rows] = minimise(reference[rows], near.of(rows), options)
    before, after = (
        cost_of(waypoints, reference, near, options).reshape(plans_m.shape[:2]).sum(axis=1)
        for waypoints in (reference, moved)
    )
    points = near.counts(count).reshape(plans_m.shape[:2])
    return MovedPlans(moved.reshape(plans_m.shape), hits, chosen, points, before, after)


def covered(
    plans_m: Float[np.ndarray, "b t 2"],
    occupied: Sequence[Occupancy],
    footprint: Footprint,
    margin_m: float = 0.0,
    step_s: float = STEP_S,
) -> Bool[np.ndarray, "b t"]:
    """At which steps a car that follows a plan covers the centre of a cell that is taken.

    Args:
        plans_m: Waypoints in the planning frame (B, T, 2).
        occupied: What is taken around each of the plans.
        footprint: The car, which is turned as its path runs.
        margin_m: Added to the car on every side.
        step_s: Time between waypoints.
    """
    boxes = footprint.along(plans_m, margin_m)
    hits = np.zeros(plans_m.shape[:2], bool)
    for plan, points in enumerate(_points(plans_m, occupied, step_s)):
        hits[plan] = [inside(each, box).any() for each, box in zip(points, boxes[plan], strict=True)]
    return hits


def surroundings(
    plans_m: Float[np.ndarray, "b t 2"],
    occupied: Sequence[Occupancy],
    options: CollisionOptions = CONDITIONAL,
    step_s: float = STEP_S,
) -> Surroundings:
    """The points that take part at each waypoint; waypoints are counted plan by plan."""
    places = [np.zeros((0, 2))]
    counts: list[int] = []
    for plan, points in zip(plans_m, _points(plans_m, occupied, step_s), strict=True):
        for waypoint, each in zip(plan, points, strict=True):
            known = np.trunc(each) if options.whole_metres else each
            close = known[np.square(known - waypoint).sum(-1) < options.radius_m**2]
            places.append(close)
            counts.append(len(close))
    return Surroundings(np.concatenate(places), np.repeat(np.arange(len(counts)), counts))


def minimise(
    reference_m: Float[np.ndarray, "n 2"], near: Surroundings, options: CollisionOptions
) -> Float[np.ndarray, "n 2"]:
    """Where the cost of each waypoint is least, downhill from its reference.

    Newton's method with the sizes of the curvatures, so that each step leads down. Steps are short, and one
    that gains too little is halved.
    """
    found = reference_m.copy()
    left = np.arange(len(found))
    for _ in range(_MOST_STEPS):
        gradient, hessian = slopes_of(found[left], reference_m[left], near, options)
        going = np.linalg.norm(gradient, axis=1) > _SETTLED * (1 + options.weight)
        left, near = left[going], near.of(going)
        if not len(left):
            return found
        step = _downhill(gradient[going], hessian[going], _LONGEST * options.sigma_m)
        gain = _ENOUGH * (gradient[going] * step).sum(-1)
        found[left] += _shortened(step, gain, found[left], reference_m[left], near, options)
    raise RuntimeError(f"plans have not settled after {_MOST_STEPS} steps of Newton's method")


def _downhill(
    gradient: Float[np.ndarray, "n 2"], hessian: Float[np.ndarray, "n 2 2"], longest_m: float
) -> Float[np.ndarray, "n 2"]:
    curvatures, axes = np.linalg.eigh(hessian)
    along = (axes.swapaxes(1, 2) @ gradient[..., None])[..., 0] / np.maximum(np.abs(curvatures), _FLATTEST)
    step = -(axes @ along[..., None])[..., 0]
    return step * np.minimum(1, longest_m / np.maximum(np.linalg.norm(step, axis=1), longest_m))[:, None]


def _shortened(
    step: Float[np.ndarray, "n 2"],
    gain: Float[np.ndarray, " n"],
    waypoints_m: Float[np.ndarray, "n 2"],
    reference_m: Float[np.ndarray, "n 2"],
    near: Surroundings,
    options: CollisionOptions,
) -> Float[np.ndarray, "n 2"]:
    """Steps that are halved until they lower the cost by their share of what the whole step promises."""
    cost = cost_of(waypoints_m, reference_m, near, options)
    share = np.ones(len(step))
    for _ in range(_HALVINGS):
        there = cost_of(waypoints_m + share[:, None] * step, reference_m, near, options)
        poor = there > cost + share * gain + _ROUNDING * cost
        if not poor.any():
            break
        share[poor] /= 2
    return share[:, None] * step


def _points(
    plans_m: Float[np.ndarray, "b t 2"], occupied: Sequence[Occupancy], step_s: float
) -> list[Sequence[Float[np.ndarray, "_ 2"]]]:
    if len(occupied) != len(plans_m):
        raise ValueError(f"{len(plans_m)} plans among {len(occupied)} surroundings; expected one for each")
    times_s = step_s * np.arange(1, plans_m.shape[1] + 1)
    return [each.points_at(times_s) for each in occupied]
