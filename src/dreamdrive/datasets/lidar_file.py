"""Points of a lidar from files, in the frame in which the file has them."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.datasets.pandaset.restricted import SWEEP
from dreamdrive.datasets.pandaset.tables import read_table
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes

_COLUMNS = {".pcd.bin": 5, ".bin": 4}
"""float32 numbers a point: those of nuScenes have intensity and ring, those of KITTI reflectance."""
_TABLES = (".pkl.gz", ".pkl")
_MOST_BYTES = 200_000_000
_FARTHEST_M = 1e7
"""Farther off nothing is that a lidar measured, in the world either."""


def read_points(path: Path) -> Float[np.ndarray, "n 3"]:
    """Points in metres: ``.pcd.bin`` of nuScenes, ``.bin`` of KITTI, ``.pkl.gz`` or ``.pkl`` of PandaSet.

    Those of nuScenes and KITTI are in the frame of the lidar, those of PandaSet in the world. What is not
    finite, or farther off than 10000 km, is left out.

    Raises:
        InputError: The file is of another kind, or does not hold whole points.
    """
    points = _of_table(path) if path.name.endswith(_TABLES) else _of_floats(path)
    return points[(np.abs(points) <= _FARTHEST_M).all(axis=1)]


def _of_table(path: Path) -> Float[np.ndarray, "n 3"]:
    table = read_table(path, SWEEP)
    if missing := [axis for axis in "xyz" if axis not in table]:
        raise InputError(f"{path} has no columns {', '.join(missing)}; expected a sweep of PandaSet")
    try:
        return np.column_stack([table[axis].astype(np.float64) for axis in "xyz"])
    except (TypeError, ValueError):
        raise InputError(f"{path}: x, y or z hold what is no number; download it again") from None


def _of_floats(path: Path) -> Float[np.ndarray, "n 3"]:
    columns = next((n for suffix, n in _COLUMNS.items() if path.name.endswith(suffix)), None)
    if columns is None:
        raise InputError(f"{path}: expected lidar points as {', '.join([*_COLUMNS, *_TABLES])}")
    data = read_bytes(path, at_most=_MOST_BYTES)
    if len(data) % (4 * columns):
        raise InputError(
            f"{path} holds {len(data)} bytes; expected whole points of {columns} float32 numbers: it may be "
            "cut short, copy it again"
        )
    with np.errstate(invalid="ignore"):  # of some NaN, which are left out
        return np.frombuffer(data, "<f4").reshape(-1, columns)[:, :3].astype(np.float64)
