"""Hills and dales of a layout: how high its map lies, and what that does to all that stands on it."""

import numpy as np
from jaxtyping import Float

from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.level import upright
from dreamdrive.scene.street.layout import Layout, Relief

# Share of the height and of the length of each wave.
_WAVES = np.array([[0.4, 1.0], [0.3, 0.73], [0.2, 0.55], [0.1, 0.41]])
STEEPEST = float(2 * np.pi * (_WAVES[:, 0] / _WAVES[:, 1]).sum())
"""Slope where all waves rise together, in heights a length."""
_ACROSS_RAD = 0.5  # spread of the waves' directions about the x axis, along which streets run
_LEVEL_M = 25.0  # about the origin it stays level for about that far


class Hills:
    """The height of the map at every place: a sum of waves, 0 with a level slope at the origin."""

    def __init__(self, relief: Relief, seed: int) -> None:
        rng = np.random.default_rng([seed, 20])
        turn = rng.normal(0, _ACROSS_RAD, len(_WAVES))
        number = 2 * np.pi / (relief.length_m * _WAVES[:, 1])
        self._vector = number[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        self._phase = rng.uniform(0, 2 * np.pi, len(_WAVES))
        self._high_m = relief.height_m * _WAVES[:, 0]
        self.level = relief.height_m == 0

    def height_m(self, points_m: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
        """Height (N,) of the map at some places."""
        return self._lift(points_m) * self._grown(points_m)

    def slope(self, points_m: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Rise a metre along x and y (N, 2)."""
        waves = self._high_m * np.cos(points_m @ self._vector.T + self._phase)
        fade = np.exp(-np.square(points_m / _LEVEL_M).sum(-1))[:, None]
        return waves @ self._vector * (1 - fade) + self._lift(points_m)[:, None] * fade * 2 * (
            points_m / _LEVEL_M**2
        )

    def _lift(self, points_m: np.ndarray) -> np.ndarray:
        return (np.sin(points_m @ self._vector.T + self._phase) - np.sin(self._phase)) @ self._high_m

    def _grown(self, points_m: np.ndarray) -> np.ndarray:
        return 1 - np.exp(-np.square(points_m / _LEVEL_M).sum(-1))

    def laid(self, pose: Float[np.ndarray, "4 4"], *, plumb: bool = False) -> Float[np.ndarray, "4 4"]:
        """A pose on the level map (4, 4) lifted and, unless it stays plumb, tilted with the slope."""
        if self.level:
            return pose
        place = pose[None, :2, 3]
        lifted = pose.copy()
        lifted[2, 3] += self.height_m(place)[0]
        if not plumb:
            lifted[:3, :3] = _tilt(self.slope(place)[0]) @ pose[:3, :3]
        return lifted

    def raised(self, points_m: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Points over the level map as far over the hills."""
        raised = points_m.copy()
        raised[:, 2] += self.height_m(points_m[:, :2])
        return raised


def hills_of(layout: Layout) -> Hills:
    """The hills of a layout; in the first edition there are none."""
    return Hills(layout.relief if layout.edition > 1 else Relief(), layout.seed)


def road_plane(world_from_map: Float[np.ndarray, "4 4"], layout: Layout) -> Ground:
    """The map in the world: z = 0, or the plane that touches the hills under the world's origin."""
    hills = hills_of(layout)
    if hills.level:
        up = world_from_map[:3, 2]
        return Ground(up, float(-up @ world_from_map[:3, 3]))
    map_from_world = np.linalg.inv(world_from_map)
    eye = map_from_world[:3, 3]
    touched = hills.laid(upright((*eye[:2], 0.0)))
    return Ground(world_from_map[:3, :3] @ touched[:3, 2], float(touched[:3, 2] @ (eye - touched[:3, 3])))


def _tilt(slope: Float[np.ndarray, "2"]) -> Float[np.ndarray, "3 3"]:
    """The rotation about a level axis that takes the vertical to the normal of a slope."""
    steep = float(np.hypot(*slope))
    if steep == 0:
        return np.eye(3)
    x, y = slope / steep
    cos, sin = 1 / np.hypot(1, steep), steep / np.hypot(1, steep)
    along = np.array([[x * x, x * y, 0], [x * y, y * y, 0], [0, 0, 1]])
    turn = np.array([[0, 0, -x], [0, 0, -y], [x, y, 0]])
    return np.eye(3) + (cos - 1) * along + sin * turn
