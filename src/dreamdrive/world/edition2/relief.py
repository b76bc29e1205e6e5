"""Hills and dales under a street: how high the map lies, and what that does to all that stands on it."""

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.scene.layout import Layout, Relief
from dreamdrive.world.mesh import Mesh

# Share of the height and of the length of each wave.
_WAVES = np.array([[0.4, 1.0], [0.3, 0.73], [0.2, 0.55], [0.1, 0.41]])
STEEPEST = float(2 * np.pi * (_WAVES[:, 0] / _WAVES[:, 1]).sum())
"""Slope where all waves rise together, in heights a length."""
_ACROSS_RAD = 0.5  # spread of the waves' directions about the x axis, along which streets run
_LEVEL_M = 25.0  # about the origin it stays level for about that far
_EDGE_M, _EDGE_SHARE = 5.0, 0.08  # longest edge of a triangle: at the origin, and as a share of its distance
_MOST_HALVINGS = 16


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

    def lifted(self, mesh: Mesh) -> Mesh:
        """A mesh of the level map on the hills, its triangles halved until they follow the ground."""
        if self.level:
            return mesh
        fine = _halved(mesh)
        raised = self.raised(fine.corners.reshape(-1, 3)).reshape(-1, 3, 3)
        return Mesh(raised, fine.uv, fine.material, fine.normals)

    def raised(self, points_m: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Points over the level map as far over the hills."""
        raised = points_m.copy()
        raised[:, 2] += self.height_m(points_m[:, :2])
        return raised


def hills_of(layout: Layout) -> Hills:
    """The hills of a layout; in the first edition there are none."""
    return Hills(layout.relief if layout.edition > 1 else Relief(), layout.seed)


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


def _halved(mesh: Mesh) -> Mesh:
    """Halve long edges until all are short. An edge is halved for its own length: neighbours do the same."""
    # What is known at every corner: its place, its place on the texture, its normal.
    normals = [] if mesh.normals is None else [mesh.normals]
    values, material = np.concatenate([mesh.corners, mesh.uv, *normals], axis=-1), mesh.material
    done: list[tuple[np.ndarray, np.ndarray]] = []
    for _ in range(_MOST_HALVINGS):
        long = _long(values[..., :3])
        split = long.any(axis=1)
        done.append((values[~split], material[~split]))
        values, material = _split(values[split], material[split], long[split])
    done.append((values, material))
    values, material = (np.concatenate(parts) for parts in zip(*done, strict=True))
    return Mesh(values[..., :3], values[..., 3:5], material, values[..., 5:] if normals else None)


def _long(corners: Float[np.ndarray, "m 3 3"]) -> Bool[np.ndarray, "m 3"]:
    """Which edges, from each corner to the next, are too long across the map."""
    here, there = corners[..., :2], np.roll(corners[..., :2], -1, axis=1)
    middle = (here + there) / 2
    length = np.linalg.norm(there - here, axis=-1)
    return length > np.maximum(_EDGE_M, _EDGE_SHARE * np.linalg.norm(middle, axis=-1))


# By how many edges are halved, the first ones: its pieces. 0-2 are corners, 3-5 the middles of edges.
_SPLITS: dict[int, list[tuple[int, int, int]]] = {
    1: [(0, 3, 2), (3, 1, 2)],
    2: [(0, 3, 2), (3, 1, 4), (3, 4, 2)],
    3: [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)],
}


def _split(
    values: Float[np.ndarray, "m 3 k"], material: Int[np.ndarray, " m"], long: Bool[np.ndarray, "m 3"]
) -> tuple[Float[np.ndarray, "n 3 k"], Int[np.ndarray, " n"]]:
    """Triangles cut at the middles of their long edges."""
    count = long.sum(axis=1)
    # Turn each so that its long edges come first.
    first = np.where(count == 2, (np.argmin(long, axis=1) + 1) % 3, np.argmax(long, axis=1))
    order = (first[:, None] + np.arange(3)) % 3
    values = np.take_along_axis(values, order[..., None], axis=1)
    points = np.concatenate([values, (values + np.roll(values, -1, axis=1)) / 2], axis=1)
    found = [points[count == cuts][:, piece] for cuts, pieces in _SPLITS.items() for piece in pieces]
    kinds = [material[count == cuts] for cuts, pieces in _SPLITS.items() for _ in pieces]
    return np.concatenate(found), np.concatenate(kinds)
