"""Meshes prepared for rays: Embree finds the triangle, tables say what is painted there."""

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Bool, Float, Int

from streetworld.engine.columns import dot, picked
from streetworld.engine.mesh import Mesh

_OFF_SURFACE_M = 2e-3


@dataclass(frozen=True)
class Hits:
    """First triangles on some rays, -1 for none; distances in lengths of the ray's direction, or infinite."""

    triangle: Int[np.ndarray, " n"]
    distance: Float[np.ndarray, " n"]


class Solid:
    """Triangles in the map frame.

    ``owner`` is the index of the rigid part each belongs to. ``to_uv`` holds rows of u and v (M, 2, 4), to be
    multiplied by (x, y, z, 1). ``curved`` tells whose corners differ in their normals, and ``to_normal``
    holds rows (M, 3, 4) of the normal between them; both are None where all triangles are flat.
    """

    def __init__(self, mesh: Mesh, owner: Int[np.ndarray, " m"], device: EmbreeDevice) -> None:
        self.corners, self.material, self.owner = mesh.corners, mesh.material, owner
        edges = mesh.corners[:, 1:] - mesh.corners[:, :1]
        across = np.cross(edges[:, 0], edges[:, 1])
        length = np.linalg.norm(across, axis=1, keepdims=True)
        self._across = np.asfortranarray(across)
        self.normals = np.asfortranarray(across / np.maximum(length, 1e-12), dtype=np.float32)
        self.to_uv = np.asfortranarray(_affine_rows(mesh.corners, mesh.uv), dtype=np.float32)
        self.curved: Bool[np.ndarray, " m"] | None = None
        self.to_normal: Float[np.ndarray, "m 3 4"] | None = None
        if mesh.normals is not None:
            self.curved = np.any(np.abs(mesh.normals - mesh.normals[:, :1]) > 1e-4, axis=(1, 2))
            self.to_normal = np.zeros((len(mesh), 3, 4))
            self.to_normal[self.curved] = _affine_rows(mesh.corners[self.curved], mesh.normals[self.curved])
        self._scene = None
        if len(mesh):
            self._scene = EmbreeScene(device)
            self._mesh = TriangleMesh(self._scene, np.ascontiguousarray(mesh.corners, dtype=np.float32))

    def __len__(self) -> int:
        return len(self.material)

    def first_hits(self, origin: Float[np.ndarray, "3"], directions: Float[np.ndarray, "n 3"]) -> Hits:
        """The nearest triangle along each ray; distances are exact to double precision."""
        count = len(directions)
        if self._scene is None or not count:
            return Hits(np.full(count, -1), np.full(count, np.inf))
        start = np.broadcast_to(origin.astype(np.float32), (count, 3)).copy()
        found = self._scene.run(start, directions.astype(np.float32), query="INTERSECT")
        triangle = np.asarray(found, dtype=np.int64)
        hit = np.flatnonzero(triangle >= 0)
        at = triangle[hit]
        distance = np.full(count, np.inf)
        slope = dot(picked(self._across, at), picked(directions, hit))
        gap = dot(self._across, self.corners[:, 0] - origin)[at]
        distance[hit] = gap / np.where(slope == 0, 1e-300, slope)
        return Hits(triangle, distance)

    def first_from(self, points: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]) -> Hits:
        """The nearest triangle along rays that start at different points, to single precision."""
        count = len(points)
        if self._scene is None or not count:
            return Hits(np.full(count, -1), np.full(count, np.inf))
        rays = np.ascontiguousarray(directions, dtype=np.float32)
        start = np.ascontiguousarray(points, dtype=np.float32) + rays * np.float32(_OFF_SURFACE_M)
        triangle = np.asarray(self._scene.run(start, rays, query="INTERSECT"), dtype=np.int64)
        hit = np.flatnonzero(triangle >= 0)
        distance = np.full(count, np.inf)
        across = picked(self._across, triangle[hit])
        slope = dot(across, picked(directions, hit))
        gap = dot(across, self.corners[triangle[hit], 0] - points[hit])
        distance[hit] = gap / np.where(slope == 0, 1e-300, slope)
        return Hits(triangle, distance)

    def hidden(
        self, points: Float[np.ndarray, "n 3"], towards: Float[np.ndarray, "3"]
    ) -> Bool[np.ndarray, " n"]:
        """Whether something lies in a direction from some points."""
        if self._scene is None or not len(points):
            return np.zeros(len(points), dtype=bool)
        rays = np.broadcast_to(towards.astype(np.float32), (len(points), 3)).copy()
        start = points.astype(np.float32) + rays * np.float32(_OFF_SURFACE_M)
        return np.asarray(self._scene.run(start, rays, query="OCCLUDED")) >= 0


def _affine_rows(
    corners: Float[np.ndarray, "m 3 3"], values: Float[np.ndarray, "m 3 k"]
) -> Float[np.ndarray, "m k 4"]:
    """The affine maps that give each corner its values and do not change along the normal."""
    first = corners[:, 0]
    a, b = corners[:, 1] - first, corners[:, 2] - first
    aa, ab, bb = (np.einsum("mi,mi->m", p, q) for p, q in ((a, a), (a, b), (b, b)))
    inverse = 1 / np.maximum(aa * bb - ab * ab, 1e-18)
    step = values[:, 1:] - values[:, :1]  # (M, edge, k)
    share_a = (bb[:, None] * step[:, 0] - ab[:, None] * step[:, 1]) * inverse[:, None]
    share_b = (aa[:, None] * step[:, 1] - ab[:, None] * step[:, 0]) * inverse[:, None]
    slope = share_a[..., None] * a[:, None] + share_b[..., None] * b[:, None]
    offset = values[:, 0] - np.einsum("mki,mi->mk", slope, first)
    return np.concatenate([slope, offset[..., None]], axis=-1)
