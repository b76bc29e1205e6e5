"""Meshes of the level map laid on its hills."""

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.scene.street.hills import Hills
from streetworld.engine.mesh import Mesh

_EDGE_M, _EDGE_SHARE = 5.0, 0.08  # longest edge of a triangle: at the origin, and as a share of its distance
_MOST_HALVINGS = 16


def lifted(hills: Hills, mesh: Mesh) -> Mesh:
    """A mesh of the level map on the hills, its triangles halved until they follow the ground."""
    if hills.level:
        return mesh
    fine = _halved(mesh)
    raised = hills.raised(fine.corners.reshape(-1, 3)).reshape(-1, 3, 3)
    return Mesh(raised, fine.uv, fine.material, fine.normals)


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
