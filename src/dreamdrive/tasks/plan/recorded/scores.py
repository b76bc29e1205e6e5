"""Scores of plans against recorded drives, step by step, and figures by horizon."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan.trajectory import STEP_S

Reading = Literal["at", "mean", "any"]
"""What a figure of h seconds is of: the step at h, as UniAD has it; all steps up to h, as ST-P3 and VAD have
it; or, for collisions, whether there was one in any step up to h."""


@dataclass(frozen=True)
class StepScores:
    """Plans of N samples over T steps.

    Attributes:
        distance_m: From the recorded drive (N, T).
        collides: Where the plan collides, and that counts (N, T).
        point_collides: Where its waypoint alone does, and that counts (N, T). None where nothing tells.
        truth_collides: Where the recorded drive itself does (N, T).
        skipped: Samples that were left out, for their recorded drive ends early.
    """

    distance_m: Float[np.ndarray, "n t"]
    collides: Bool[np.ndarray, "n t"]
    point_collides: Bool[np.ndarray, "n t"] | None
    truth_collides: Bool[np.ndarray, "n t"]
    skipped: int = 0


@dataclass(frozen=True)
class HorizonScore:
    """Figures of one horizon.

    Attributes:
        horizon_s: Time from now.
        distance_m: Mean distance from the recorded drive. With "any" it is that at the horizon.
        collisions: How many there were.
        cases: Among how many they were counted: samples, with "mean" samples times steps.
    """

    horizon_s: float
    distance_m: float
    collisions: int
    cases: int

    @property
    def collision_rate(self) -> float:
        """Collisions as a share of the cases; tables have it in per cent."""
        return self.collisions / self.cases


@dataclass(frozen=True)
class PlanScore:
    """The figures of a table's row.

    Attributes:
        horizons: By time.
        samples: Counted.
        skipped: Left out.
    """

    horizons: tuple[HorizonScore, ...]
    samples: int
    skipped: int

    @property
    def distance_m(self) -> float:
        """Mean over the horizons, the tables' average."""
        return float(np.mean([each.distance_m for each in self.horizons]))

    @property
    def collision_rate(self) -> float:
        """Mean over the horizons, the tables' average."""
        return float(np.mean([each.collision_rate for each in self.horizons]))


def summarise(
    scores: StepScores,
    reading: Reading,
    horizons_s: Sequence[float] = (1.0, 2.0, 3.0),
    step_s: float = STEP_S,
) -> PlanScore:
    """The figures of a set of samples.

    Args:
        scores: Of all samples together.
        reading: What a figure of a horizon is of.
        horizons_s: Times of figures, each that of a step.
        step_s: Time between steps.

    Raises:
        InputError: There is no sample, or no step at a horizon.
    """
    samples, steps = scores.distance_m.shape
    if not samples:
        raise InputError(
            f"no sample is left ({scores.skipped} end early); expected some with all {steps} steps"
        )
    found: list[HorizonScore] = []
    for horizon_s in horizons_s:
        step = round(horizon_s / step_s)
        if not 1 <= step <= steps or abs(step * step_s - horizon_s) > 1e-9:
            raise InputError(
                f"figures at {horizon_s} s; expected a multiple of {step_s} s up to {steps * step_s} s"
            )
        counted = scores.collides[:, :step] if reading == "mean" else scores.collides[:, step - 1 : step]
        if reading == "any":
            counted = scores.collides[:, :step].any(axis=1)
        distances = scores.distance_m[:, :step] if reading == "mean" else scores.distance_m[:, step - 1]
        found.append(HorizonScore(horizon_s, float(distances.mean()), int(counted.sum()), counted.size))
    return PlanScore(tuple(found), samples, scores.skipped)
