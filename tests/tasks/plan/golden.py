"""Samples and answers of the golden numbers of planning."""

import numpy as np

from dreamdrive.tasks.plan import GRID, Agents, Occupancy
from tests.golden.reading import arrays

METRIC, TABLES = "eval/planning_metric.npz", "eval/planning_metric_tables.json"
OPTIMISED = "eval/collision_optimization.npz"


def cells(packed: np.ndarray) -> np.ndarray:
    """Cells of the published grid by sample and step, out of their bits."""
    return np.unpackbits(packed, axis=-1).reshape(len(packed), -1, GRID.cells, GRID.cells)


def rasters(columns: str) -> np.ndarray:
    """Cells of all samples and steps, columns to the right or to the left."""
    given = arrays(METRIC)
    taken = cells(given["seg"])
    taken[given["seg_value_invalid"]] *= 255
    return taken if columns == "right" else taken[..., ::-1]


def known() -> np.ndarray:
    return arrays(METRIC)["mask"].all(axis=-1).astype(bool)


def agents() -> list[Agents]:
    given = arrays(METRIC)
    steps = given["pred"].shape[1]
    counts = given["box_count"].tolist()
    found = np.split(given["boxes"], steps * np.cumsum(counts)[:-1])
    return [
        Agents(
            boxes=boxes.reshape(steps, count, 5).astype(np.float64),
            there=np.ones((steps, count), bool),
            categories=("vehicle.car",) * count,
            seen=np.ones(count, bool),
        )
        for boxes, count in zip(found, counts, strict=True)
    ]


def occupied() -> list[Occupancy]:
    return [Occupancy(each.astype(bool)) for each in cells(arrays(OPTIMISED)["occ"])]
