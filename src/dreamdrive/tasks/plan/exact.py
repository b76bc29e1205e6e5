"""Collisions without cells: a car that turns with its path against the boxes of road users."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.tasks.plan.agents import Agents
from dreamdrive.tasks.plan.footprint import CAR, Footprint
from dreamdrive.tasks.plan.recorded.scores import StepScores
from dreamdrive.tasks.plan.rectangles import overlapping


@dataclass(frozen=True)
class ExactOptions:
    """How to count.

    Attributes:
        footprint: The car.
        excuse_truth: Steps at which the recorded drive itself collides do not count, but stay among the
            cases. Off: an overlap is an overlap. ``StepScores.truth_collides`` tells what errors of labels
            and footprint make of it.
    """

    footprint: Footprint = CAR
    excuse_truth: bool = False


EXACT = ExactOptions()


def exact_scores(
    plans_m: Float[np.ndarray, "n t 2"],
    truth_m: Float[np.ndarray, "n t 2"],
    known: Bool[np.ndarray, "n t"],
    agents: Sequence[Agents],
    options: ExactOptions = EXACT,
) -> StepScores:
    """Compare plans with recorded drives; those that end early are left out.

    Args:
        plans_m: Waypoints in the planning frame (N, T, 2).
        truth_m: The recorded drives (N, T, 2).
        known: Which steps of the recorded drives there are (N, T).
        agents: The road users around each sample, vehicles and people.
        options: How to count.
    """
    if len(agents) != len(plans_m):
        raise ValueError(
            f"{len(plans_m)} plans among {len(agents)} sets of road users; expected one for each"
        )
    kept = np.flatnonzero(known.all(axis=1))
    plans, truth = plans_m[kept].astype(np.float64), truth_m[kept].astype(np.float64)
    around = [agents[sample] for sample in kept.tolist()]
    hits, true_hits = (collisions(each, around, options.footprint) for each in (plans, truth))
    return StepScores(
        distance_m=np.linalg.norm(plans - truth, axis=-1),
        collides=hits & ~true_hits if options.excuse_truth else hits,
        point_collides=None,
        truth_collides=true_hits,
        skipped=len(plans_m) - len(kept),
    )


def collisions(
    plans_m: Float[np.ndarray, "n t 2"], agents: Sequence[Agents], footprint: Footprint = CAR
) -> Bool[np.ndarray, "n t"]:
    """At which steps a car that follows a plan overlaps or touches the box of a road user (N, T)."""
    cars = footprint.along(plans_m)
    hits = np.zeros(plans_m.shape[:2], bool)
    for sample, around in enumerate(agents):
        hits[sample] = (overlapping(cars[sample][:, None], around.boxes) & around.there).any(axis=1)
    return hits
