"""Road users around a car over the steps of a plan."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float


@dataclass(frozen=True)
class Agents:
    """The boxes of N road users at T steps, seen from above in the planning frame of now.

    Attributes:
        boxes: x, y, length, width, yaw (T, N, 5); any numbers where there is none.
        there: Which of them have a box at which step (T, N).
        categories: In the words of nuScenes, such as ``vehicle.car``.
        seen: Which of them cameras saw well up to now: 40 % or more of them, at one time at least (N,).
    """

    boxes: Float[np.ndarray, "t n 5"]
    there: Bool[np.ndarray, "t n"]
    categories: tuple[str, ...]
    seen: Bool[np.ndarray, " n"]

    def __post_init__(self) -> None:
        if len(self.categories) != self.there.shape[1]:
            raise ValueError(f"{len(self.categories)} categories of {self.there.shape[1]} road users")
        given = self.boxes[self.there]
        if not np.isfinite(given).all() or (given[:, 2:4] < 0).any():
            raise ValueError("boxes of road users: expected finite numbers, and no length or width below 0")
