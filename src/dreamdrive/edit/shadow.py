"""The shadow of an actor on the road: found on what was seen beside it, taken off, and set down elsewhere."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from dreamdrive.scene.actor import Actor
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.scene import Scene

REACH_M = 1.5
"""Beside its box, where an actor's shadow is looked for."""
LOW_M = 0.25
"""Above or below the bottom of an actor, where the road is."""
AROUND_M = 6.0
"""From what may be shadow, where the road in the light is looked for."""
NEIGHBOURS = 24
"""Gaussians whose mean brightness is that of a place."""
BRIGHTEST = 4.0
"""Times, at most, that a shadow is made brighter."""


@dataclass(frozen=True)
class Shaded:
    """Road that was seen beside an actor.

    Attributes:
        rows: Which of the static Gaussians.
        beside_m: Their places (N, 2) then, ahead and to the left of its middle.
        share: Their brightness as a share of that of the road around in the light (N,), smoothed.
    """

    rows: Float[np.ndarray, " n"]
    beside_m: Float[np.ndarray, "n 2"]
    share: Float[np.ndarray, " n"]
