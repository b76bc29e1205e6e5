"""The grid seen from above in which a street is segmented."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError


@dataclass(frozen=True)
class BevGrid:
    """Cells around the car as an image: ahead is up, left is left, the car is in the middle.

    The ego frame is x ahead, y left, in metres. Cell (row, column) stands for the point of the lattice at
    just these numbers, not for half a cell further on, as in the original (Cross-View Transformers, 2022).

    Attributes:
        rows: Cells from ahead to behind.
        columns: Cells from left to right.
        length_m: Metres that the rows span.
        width_m: Metres that the columns span.
    """

    rows: int = 200
    columns: int = 200
    length_m: float = 100.0
    width_m: float = 100.0

    def __post_init__(self) -> None:
        if min(self.rows, self.columns) < 1 or not min(self.length_m, self.width_m) > 0:
            raise InputError(f"{self} has no cells; expected counts and lengths above 0")

    def pixels_from_ego(self) -> Float[np.ndarray, "3 3"]:
        """From (x, y, 1) in metres to (column, row, 1)."""
        across, down = self.columns / self.width_m, self.rows / self.length_m
        return np.array([[0.0, -across, self.columns / 2], [-down, 0.0, self.rows / 2], [0.0, 0.0, 1.0]])
