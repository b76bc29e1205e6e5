"""A road user that is to be placed on a street."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.street.layout import BoxKind


@dataclass(frozen=True)
class DrawnRoadUser:
    """Who would be where: x, y and yaw at each of the street's times; ``first`` are served first."""

    kind: BoxKind
    size_m: tuple[float, float, float]
    look: int
    places: Float[np.ndarray, "t 3"]
    first: bool = False

    @property
    def moving(self) -> bool:
        """Whether it ever goes anywhere."""
        return bool(np.ptp(self.places[:, :2], axis=0).max() > 0.05)
