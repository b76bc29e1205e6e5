"""Distances between a path and the one asked for."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

STRETCHES = 8
"""Lengths of the stretches that are compared: 1/8, 2/8, ... of the path; KITTI takes 100, 200, ... 800 m."""
_STANDING_M = 1e-6


@dataclass(frozen=True)
class PathError:
    """Differences of two paths after the best similarity transform (rotation, shift and one scale).

    Attributes:
        ate_m: Root mean square distance of the positions, in metres of the path asked for.
        ate_percent: The same in per cent of the length of the path asked for.
        translation_percent: Mean difference in place at the end of a stretch, in per cent of its length.
        rotation_deg_per_m: Mean difference in heading at the end of a stretch, in degrees over its length.
        scale: Metres asked for over the unit of the path found: free, and no part of the other figures. Where
            that unit is the metre, it tells a wrong speed.
    """

    ate_m: float
    ate_percent: float
    translation_percent: float
    rotation_deg_per_m: float
    scale: float


def compare_paths(found: Float[np.ndarray, "t 4 4"], asked: Float[np.ndarray, "t 4 4"]) -> PathError | None:
    """Compare pose by pose a path that was found, in any world and unit, with the one asked for, in metres.

    The absolute error follows Sturm et al. 2012 (ATE, aligned by Umeyama 1991), the relative one the odometry
    benchmark of KITTI (Geiger et al. 2012): from each pose over each stretch of the path, here of eighths of
    its length. A path that stays where it is has scale 1 and, on a straight road, 100 % of translation error.
    None when the path asked for stands still: over its length errors have no meaning.
    """
    travelled = np.concatenate([[0], np.cumsum(_steps(asked))])
    if travelled[-1] < _STANDING_M:
        return None
    scale, distance = _aligned(found[:, :3, 3], asked[:, :3, 3])
    ate = float(np.sqrt(np.square(distance).mean()))
    scaled = found.copy()
    scaled[:, :3, 3] *= scale
    translation, rotation = _relative(scaled, asked, travelled)
    return PathError(ate, 100 * ate / float(travelled[-1]), 100 * translation, rotation, scale)


def _steps(poses: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)


def _aligned(found: np.ndarray, asked: np.ndarray) -> tuple[float, np.ndarray]:
    """Scale of the similarity that brings ``found`` (T, 3) nearest to ``asked``, and what is left (T,)."""
    here, there = found - found.mean(axis=0), asked - asked.mean(axis=0)
    spread = np.square(here).sum()
    if spread < _STANDING_M**2:
        return 1.0, np.linalg.norm(there, axis=1)
    left, strength, right = np.linalg.svd(there.T @ here)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    scale = float((strength * sign).sum() / spread)
    return scale, np.linalg.norm(scale * here @ ((left * sign) @ right).T - there, axis=1)


def _relative(found: np.ndarray, asked: np.ndarray, travelled: np.ndarray) -> tuple[float, float]:
    """Mean error in place (share of the stretch) and in heading (degrees a metre) over all stretches."""
    places: list[float] = []
    headings: list[float] = []
    for length in np.arange(1, STRETCHES + 1) * travelled[-1] / STRETCHES:
        ends = np.searchsorted(travelled, travelled + length * (1 - 1e-9))
        for start in np.flatnonzero(ends < len(travelled)).tolist():
            end = int(ends[start])
            metres = travelled[end] - travelled[start]
            error = np.linalg.inv(_between(asked, start, end)) @ _between(found, start, end)
            places.append(float(np.linalg.norm(error[:3, 3])) / metres)
            headings.append(np.degrees(Rotation.from_matrix(error[:3, :3]).magnitude()) / metres)
    return float(np.mean(places)), float(np.mean(headings))


def _between(poses: np.ndarray, start: int, end: int) -> np.ndarray:
    return np.linalg.inv(poses[start]) @ poses[end]
