"""The grid of cells around a car in which plans are judged, and which of its cells are taken."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan.trajectory import STEP_S


@dataclass(frozen=True)
class PlanningGrid:
    """Square cells around the origin; the row counts along the axis ahead, the column along that aside.

    As in UniAD and ST-P3 the first row lies behind and the first column at the smallest x. A cell is the
    square between two lines of the grid each way, and its centre is where the optimisation takes it to be.
    Drawing follows ST-P3: cell k stands for line k, so that what is drawn and then read as cells lies half a
    cell ahead and to the right of where it is.

    Attributes:
        cells: In each row and column; an even number.
        cell_m: Side of a cell.
    """

    cells: int = 200
    cell_m: float = 0.5

    def __post_init__(self) -> None:
        if self.cells < 2 or self.cells % 2 or not 0 < self.cell_m < np.inf:
            raise InputError(f"{self}; expected an even number of cells, and sides above 0 metres")

    @property
    def half_m(self) -> float:
        """From the origin to the border."""
        return self.cells * self.cell_m / 2

    def centres_m(self, cells: Int[np.ndarray, "*b 2"]) -> Float[np.ndarray, "*b 2"]:
        """Middles (..., 2) as x, y of cells given as row, column."""
        return (cells[..., ::-1] - self.cells // 2) * self.cell_m + self.cell_m / 2

    def cells_at(self, points_m: Float[np.ndarray, "*b 2"]) -> Int[np.ndarray, "*b 2"]:
        """Row and column (..., 2) of the cells that points x, y lie in; outside the grid they go on."""
        return np.floor(points_m[..., ::-1] / self.cell_m).astype(np.int64) + self.cells // 2

    def holds(self, cells: Int[np.ndarray, "*b 2"]) -> Bool[np.ndarray, "*b"]:
        """Which rows and columns are those of the grid."""
        return np.logical_and.reduce((cells >= 0) & (cells < self.cells), axis=-1)

    def taken(self, points_m: Float[np.ndarray, "n 2"]) -> Bool[np.ndarray, "c c"]:
        """Cells in which points x, y lie; those outside the grid are left out."""
        cells = self.cells_at(points_m)
        found = np.zeros((self.cells, self.cells), bool)
        found[tuple(cells[self.holds(cells)].T)] = True
        return found

    def vertices(self, points_m: Float[np.ndarray, "*b 2"]) -> Int[np.ndarray, "*b 2"]:
        """Column and row (..., 2) to which ST-P3 and UniAD round a corner; halves go to even ones."""
        return np.round((points_m + self.half_m) / self.cell_m).astype(np.int32)

    def draw(self, polygons: Float[np.ndarray, "n k 2"]) -> UInt8[np.ndarray, "c c"]:
        """1 in the cells of polygons, one by one, as ST-P3 and UniAD draw them; borders are included."""
        cells = np.zeros((self.cells, self.cells), np.uint8)
        for polygon in self.vertices(polygons):
            cv2.fillPoly(cells, [polygon], 1)
        return cells


GRID = PlanningGrid()
"""The cells of all published figures: 200 of 0.5 m each way."""


@dataclass(frozen=True)
class Occupancy:
    """Which cells around a car are taken, now and later, in the planning frame of now.

    Attributes:
        taken: By time, row and column (F, C, C); the first is now.
        grid: The cells.
        step_s: Time from one to the next. The last goes on for ever.
    """

    taken: Bool[np.ndarray, "f c c"]
    grid: PlanningGrid = GRID
    step_s: float = STEP_S

    def __post_init__(self) -> None:
        if not len(self.taken) or self.taken.shape[1] != self.grid.cells:
            raise ValueError(f"cells of shape {self.taken.shape}; expected some of {self.grid}")

    def points_at(self, times_s: Float[np.ndarray, " t"]) -> Sequence[Float[np.ndarray, "_ 2"]]:
        """At each time the centres (N, 2) of the cells that are taken."""
        frames = np.clip(np.round(times_s / self.step_s).astype(int), 0, len(self.taken) - 1)
        points = {frame: self.grid.centres_m(self._cells(frame)) for frame in set(frames.tolist())}
        return [points[frame] for frame in frames.tolist()]

    def _cells(self, frame: int) -> Int[np.ndarray, "n 2"]:
        # Five times quicker than ``argwhere``.
        numbers = np.flatnonzero(self.taken[frame].ravel())
        return np.column_stack(np.divmod(numbers, self.grid.cells))
