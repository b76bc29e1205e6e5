"""Occupied ground over time: rectangles that never meet."""

import numpy as np
import shapely
from jaxtyping import Bool, Float

from streetworld.engine.columns import dot


class TakenGround:
    """Rectangles that take part of the ground, each with a place at all of the same times."""

    def __init__(self) -> None:
        self._places: list[np.ndarray] = []
        self._sizes: list[tuple[float, float]] = []

    def take(
        self,
        places: Float[np.ndarray, "t 3"],
        size_m: tuple[float, float],
        clear_m: float = 0.0,
        *,
        firm: bool = False,
    ) -> bool:
        """Keep x, y and yaw of a rectangle if it is clear of all others; ``firm`` keeps it in any case."""
        wide = size_m[0] + clear_m, size_m[1] + clear_m
        if not firm and self._places and self._meets(places, wide):
            return False
        self._places.append(places)
        self._sizes.append(size_m)
        return True

    def covered(self) -> list[shapely.Polygon]:
        """Every place on which a rectangle ever stands."""
        found: list[shapely.Polygon] = []
        for places, size in zip(self._places, self._sizes, strict=True):
            still = np.ptp(places[:, :2], axis=0).max() < 0.05
            found += [shapely.Polygon(ring) for ring in _corners(places[:1] if still else places, size)]
        return found

    def _meets(self, places: np.ndarray, size_m: tuple[float, float]) -> bool:
        others, sizes = np.stack(self._places), np.array(self._sizes)
        reach = 0.5 * (np.hypot(*size_m) + np.hypot(*sizes.T))
        away = np.linalg.norm(others[..., :2] - places[:, :2], axis=-1)
        who, when = np.nonzero(away < reach[:, None])
        if not len(who):
            return False
        a, b = places[when], others[who, when]
        return bool(overlapping(a, np.broadcast_to(size_m, (len(who), 2)), b, sizes[who]).any())


def overlapping(
    a: Float[np.ndarray, "n 3"],
    a_size_m: Float[np.ndarray, "n 2"],
    b: Float[np.ndarray, "n 3"],
    b_size_m: Float[np.ndarray, "n 2"],
) -> Bool[np.ndarray, " n"]:
    """Which pairs of rectangles overlap, from x, y and yaw, length and width: no side divides them."""
    between = b[:, :2] - a[:, :2]
    cos, sin = np.abs(np.cos(b[:, 2] - a[:, 2])), np.abs(np.sin(b[:, 2] - a[:, 2]))
    apart = np.zeros(len(a), dtype=bool)
    for own, size, other in ((a, a_size_m, b_size_m), (b, b_size_m, a_size_m)):
        ahead = np.stack([np.cos(own[:, 2]), np.sin(own[:, 2])], axis=-1)
        left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)
        for axis, mine, theirs in (
            (ahead, size[:, 0], other[:, 0] * cos + other[:, 1] * sin),
            (left, size[:, 1], other[:, 0] * sin + other[:, 1] * cos),
        ):
            apart |= np.abs(dot(between, axis)) > 0.5 * (mine + theirs)
    return ~apart


def _corners(places: Float[np.ndarray, "t 3"], size_m: tuple[float, float]) -> Float[np.ndarray, "t 4 2"]:
    length, width = size_m
    corner = 0.5 * np.array([[length, width], [-length, width], [-length, -width], [length, -width]])
    cos, sin = np.cos(places[:, 2]), np.sin(places[:, 2])
    turn = np.stack([np.stack([cos, -sin], -1), np.stack([sin, cos], -1)], axis=1)
    return np.einsum("tij,cj->tci", turn, corner) + places[:, None, :2]
