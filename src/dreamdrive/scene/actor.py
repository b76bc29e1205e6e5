"""A thing that moves."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Actor:
    """A group of dynamic Gaussians that move as one: those whose ``Gaussians.actor`` is ``id``.

    The name is unique, for people, such as ``"actor 3"``; the kind such as ``"vehicle"`` or ``"unknown"``.
    The track is of its centre, in the world; its times increase strictly.
    """

    id: int
    name: str
    kind: str
    count: int
    times_s: Float[np.ndarray, " t"]
    positions_m: Float[np.ndarray, "t 3"]

    def __post_init__(self) -> None:
        if len(self.times_s) == 0 or (np.diff(self.times_s) <= 0).any():
            raise ValueError(f"{self.name}: expected at least one track point and strictly increasing times")

    @property
    def first_s(self) -> float:
        """When it is first seen."""
        return float(self.times_s[0])

    @property
    def last_s(self) -> float:
        """When it is last seen."""
        return float(self.times_s[-1])

    @property
    def path_length_m(self) -> float:
        """Length of its track."""
        return float(np.linalg.norm(np.diff(self.positions_m, axis=0), axis=1).sum())
