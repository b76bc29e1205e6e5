"""The published metrics of open-loop planning: distance from the recorded drive, and collisions in a raster.

They are exact to UniAD's and ST-P3's programs, with all that is odd about them. ``exact`` has what should be
counted.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan.recorded.scores import Reading, StepScores

_CELLS, _CELL_M, _FIRST_M = 200, 0.5, -49.75
_CAR_ROWS, _CAR_COLUMNS = np.mgrid[97:105, 98:102].reshape(2, 32)
"""The cells of a car at the origin, 4.084 m x 1.85 m and half a metre ahead of it: always these 32."""


@dataclass(frozen=True)
class Convention:
    """How a published metric counts.

    Attributes:
        columns: To which side columns of the raster count: right as UniAD's or left as ST-P3's.
        excuse_truth: Steps at which the recorded drive itself touches a taken cell never count as collisions,
            but stay among the cases.
        masked: Steps after the end of the recorded drive have distance 0; else they are compared with the
            origin, as ST-P3 does. In both cases they stay among the cases.
        complete_only: Leave samples out whose recorded drive ends before the last step, as VAD does.
        reading: What a figure of a horizon is of.
        snap_m: Coordinates below it become 0. AD-MLP's remedy: at standstill a waypoint of -1e-6 m moves the
            whole car by a cell. 0 in the published figures.
    """

    columns: Literal["right", "left"]
    excuse_truth: bool = True
    masked: bool = False
    complete_only: bool = False
    reading: Reading = "at"
    snap_m: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.snap_m < np.inf:
            raise InputError(f"snap_m {self.snap_m}; expected 0 metres or more")


UNIAD_METRIC = Convention("right", masked=True)
"""UniAD's table: vehicles in the planning frame, figures at the horizon."""
STP3_METRIC = Convention("left", reading="mean")
"""ST-P3's table: vehicles and people in the ego frame, figures averaged up to the horizon.

Its raster and its waypoints are 0.94 m apart: the raster is drawn around the rear axle, waypoints count from
the lidar.
"""


def raster_scores(
    plans_m: Float[np.ndarray, "n t 2"],
    truth_m: Float[np.ndarray, "n t 2"],
    known: Bool[np.ndarray, "n t"],
    rasters: UInt8[np.ndarray, "n t 200 200"],
    convention: Convention,
) -> StepScores:
    """Compare plans with recorded drives as a published metric does.

    Args:
        plans_m: Waypoints in the planning frame, x right and y ahead (N, T, 2).
        truth_m: The recorded drives (N, T, 2); any numbers where they have ended.
        known: Which steps of the recorded drives there are (N, T).
        rasters: Taken cells at each step, see ``rasters``; rows count from behind (N, T, 200, 200).
        convention: How to count.
    """
    kept = known.all(axis=1) if convention.complete_only else np.ones(len(known), bool)
    plans = plans_m[kept].astype(np.float32)
    truth = np.where(known[kept][..., None], truth_m[kept], 0).astype(np.float32)
    apart = np.linalg.norm(plans.astype(np.float64) - truth, axis=-1)
    side = np.array([1, 1] if convention.columns == "right" else [-1, 1], np.float32)
    places, true_places = (_snapped(each, convention.snap_m) * side for each in (plans, truth))
    taken = rasters[kept] > 0
    touched = box_test(true_places, taken)
    counts = ~touched if convention.excuse_truth else np.ones_like(touched)
    return StepScores(
        np.where(known[kept], apart, 0) if convention.masked else apart,
        box_test(places, taken) & counts,
        point_test(places, taken) & counts,
        touched,
        int((~kept).sum()),
    )


def box_test(
    places_m: Float[np.ndarray, "n t 2"], taken: Bool[np.ndarray, "n t 200 200"]
) -> Bool[np.ndarray, "n t"]:
    """Whether a car that points straight ahead touches a taken cell.

    Its heading is left out, and places outside the grid count as on its border, as published.

    Args:
        places_m: Along the columns and along the rows of the raster (N, T, 2).
        taken: By row and column.
    """
    # In double precision: so near to the origin the published programs add the cells.
    at = places_m.astype(np.float64) / _CELL_M
    columns, rows = (
        np.clip(np.trunc(at[..., axis, None] + own).astype(np.int64), 0, _CELLS - 1)
        for axis, own in enumerate((_CAR_COLUMNS, _CAR_ROWS))
    )
    return np.logical_or.reduce(_at(taken, rows, columns), axis=-1)


def point_test(
    places_m: Float[np.ndarray, "n t 2"], taken: Bool[np.ndarray, "n t 200 200"]
) -> Bool[np.ndarray, "n t"]:
    """Whether the cell of a waypoint itself is taken; outside the grid none is.

    Args:
        places_m: Along the columns and along the rows of the raster (N, T, 2).
        taken: By row and column.
    """
    # In single precision, as the published programs.
    cells = np.trunc((places_m.astype(np.float32) - np.float32(_FIRST_M)) / np.float32(_CELL_M)).astype(
        np.int64
    )
    held = ((cells >= 0) & (cells < _CELLS)).all(axis=-1)
    columns, rows = (np.where(held, cells[..., axis], 0)[..., None] for axis in range(2))
    return _at(taken, rows, columns)[..., 0] & held


def _snapped(places_m: Float[np.ndarray, "n t 2"], snap_m: float) -> Float[np.ndarray, "n t 2"]:
    return np.where(np.abs(places_m) < snap_m, np.float32(0), places_m)


def _at(
    taken: Bool[np.ndarray, "n t 200 200"], rows: Int[np.ndarray, "n t k"], columns: Int[np.ndarray, "n t k"]
) -> Bool[np.ndarray, "n t k"]:
    samples, steps = np.ogrid[: taken.shape[0], : taken.shape[1]]
    return taken[samples[..., None], steps[..., None], rows, columns]
