"""Triangles with painted surfaces, and the simple bodies a street is made of.

A body has its own frame: x ahead, y to the left, z up, in metres, its origin on the ground. Corners run
counter-clockwise seen from outside.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from jaxtyping import Float, Int


@dataclass(frozen=True)
class Mesh:
    """Triangles: places in metres by triangle, corner and axis, and the index of the material of each.

    ``uv`` is the place of each corner on its texture: 0 to 1 is once across, v downwards. ``normals`` are
    unit normals at the corners, between which a curved body is shaded; None shades each triangle as it lies.
    """

    corners: Float[np.ndarray, "m 3 3"]
    uv: Float[np.ndarray, "m 3 2"]
    material: Int[np.ndarray, " m"]
    normals: Float[np.ndarray, "m 3 3"] | None = None

    def __len__(self) -> int:
        return len(self.material)

    def moved(self, pose: Float[np.ndarray, "4 4"]) -> "Mesh":
        """The same in another frame."""
        corners = np.einsum("ij,mcj->mci", pose[:3, :3], self.corners) + pose[:3, 3]
        turned = self.normals
        if turned is not None:
            turned = np.einsum("ij,mcj->mci", pose[:3, :3], turned)
        return Mesh(corners, self.uv, self.material, turned)

    def flat_normals(self) -> Float[np.ndarray, "m 3 3"]:
        """Unit normals of the triangles, at each corner the same."""
        across = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
        return np.repeat(across[:, None], 3, axis=1)

    @staticmethod
    def joined(parts: Sequence["Mesh"]) -> "Mesh":
        """All of them as one."""
        if not parts:
            return Mesh(np.zeros((0, 3, 3)), np.zeros((0, 3, 2)), np.zeros(0, dtype=np.int64))
        fields = zip(*((p.corners, p.uv, p.material) for p in parts), strict=True)
        made = Mesh(*(np.concatenate(field) for field in fields))
        if all(p.normals is None for p in parts):
            return made
        normals = [p.flat_normals() if p.normals is None else p.normals for p in parts]
        return Mesh(made.corners, made.uv, made.material, np.concatenate(normals))


def quads(
    corners: Float[np.ndarray, "q 4 3"],
    material: Int[np.ndarray, " q"] | int,
    size: Float[np.ndarray, "q 2"] | None = None,
) -> Mesh:
    """Quadrilaterals, corners from the lower left on; upright textures, ``size`` (Q, 2) times across."""
    corners = np.asarray(corners, dtype=np.float64)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], dtype=np.float64)[None]
    uv = np.repeat(uv, len(corners), axis=0)
    if size is not None:
        # From the top down, so that a texture larger than the wall loses its foot last.
        uv = uv * np.asarray(size)[:, None]
    pick = np.array([[0, 1, 2], [0, 2, 3]])
    kind = np.broadcast_to(np.asarray(material), (len(corners),))
    return Mesh(corners[:, pick].reshape(-1, 3, 3), uv[:, pick].reshape(-1, 3, 2), np.repeat(kind, 2))


_FACES = [(1, 0, 4, 5), (3, 2, 6, 7), (0, 3, 7, 4), (2, 1, 5, 6), (4, 7, 6, 5), (0, 1, 2, 3)]
"""Of a frustum: left, right, back, front, top, bottom; corners of ``frustum`` from the lower left."""


def frustum(
    low: tuple[float, float, float, float],
    high: tuple[float, float, float, float],
    z_m: tuple[float, float],
    materials: Sequence[int | None],
) -> Mesh:
    """A body between a lower and an upper rectangle (x0, x1, y0, y1) at two heights.

    Materials are those of the faces left, right, back, front, top and bottom; None leaves one out.
    """
    points = [
        [x, y, z]
        for (x0, x1, y0, y1), z in ((low, z_m[0]), (high, z_m[1]))
        for x, y in ((x0, y1), (x1, y1), (x1, y0), (x0, y0))
    ]
    shown = [(face, m) for face, m in zip(_FACES, materials, strict=True) if m is not None]
    corners = np.array([[points[i] for i in face] for face, _ in shown])
    return quads(corners, np.array([m for _, m in shown]))


def box(centre_m: Sequence[float], size_m: Sequence[float], material: int | Sequence[int | None]) -> Mesh:
    """A box; one material, or those of ``frustum``'s faces."""
    (x, y, z), (length, width, height) = centre_m, size_m
    rectangle = (x - length / 2, x + length / 2, y - width / 2, y + width / 2)
    materials = [material] * 6 if isinstance(material, int) else material
    return frustum(rectangle, rectangle, (z - height / 2, z + height / 2), materials)


def cylinder(
    start_m: Sequence[float],
    end_m: Sequence[float],
    radii_m: tuple[float, float],
    side: int,
    cap: int | None = None,
    sides: int = 10,
) -> Mesh:
    """A round bar from one point to another, with its radii there; caps show the whole texture."""
    start, end = np.asarray(start_m, dtype=np.float64), np.asarray(end_m, dtype=np.float64)
    axis = (end - start) / np.linalg.norm(end - start)
    across = np.cross(axis, [0.0, 0, 1] if abs(axis[2]) < 0.9 else [1.0, 0, 0])
    across /= np.linalg.norm(across)
    other = np.cross(axis, across)
    angle = np.linspace(0, 2 * np.pi, sides + 1)
    round_ = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * other
    low, high = start + radii_m[0] * round_, end + radii_m[1] * round_
    body = quads(np.stack([low[:-1], low[1:], high[1:], high[:-1]], axis=1), side)
    if cap is None:
        return body
    flat = 0.5 + 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    middle = np.full((sides, 2), 0.5)
    ends = []
    for centre, ring, turn in ((start, low, 1), (end, high, 0)):
        first, second = (ring[1:], ring[:-1]) if turn else (ring[:-1], ring[1:])
        uv = np.stack([middle, *((flat[1:], flat[:-1]) if turn else (flat[:-1], flat[1:]))], axis=1)
        corners = np.stack([np.repeat(centre[None], sides, axis=0), first, second], axis=1)
        ends.append(Mesh(corners, uv, np.full(sides, cap)))
    return Mesh.joined([body, *ends])


def ball(
    centre_m: Sequence[float],
    radii_m: Sequence[float],
    material: int,
    rings: int = 6,
    bumps: np.random.Generator | None = None,
) -> Mesh:
    """An ellipsoid; with ``bumps`` its surface is uneven by a fifth."""
    down = np.linspace(0, np.pi, rings + 1)[:, None]
    turn = np.linspace(0, 2 * np.pi, 2 * rings + 1)[None]
    unit = np.stack(
        [np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down) + 0 * turn], axis=-1
    )
    if bumps is not None:
        grow = bumps.uniform(0.8, 1.2, (rings + 1, 2 * rings + 1, 1))
        grow[0], grow[-1], grow[:, -1] = grow[0, 0], grow[-1, 0], grow[:, 0]
        unit = unit * grow
    points = np.asarray(centre_m) + np.asarray(radii_m) * unit
    corners = np.stack([points[1:, :-1], points[1:, 1:], points[:-1, 1:], points[:-1, :-1]], axis=2)
    return quads(corners.reshape(-1, 4, 3), material)


def walls(
    ring: Sequence[Sequence[float]], z_m: tuple[float, float], material: int, texture_m: tuple[float, float]
) -> Mesh:
    """Upright walls on a closed outline, facing outwards; the texture is ``texture_m`` wide and high."""
    outline = shapely.orient_polygons(shapely.Polygon(ring))
    points = np.array(outline.exterior.coords)
    here, there = points[:-1], points[1:]
    low, high = (np.full((len(here), 1), z) for z in z_m)
    around = ((here, low), (there, low), (there, high), (here, high))
    corners = np.stack([np.hstack(corner) for corner in around], axis=1)
    # A wall takes whole textures across, so that no window is cut.
    times = np.maximum(1, np.rint(np.linalg.norm(there - here, axis=1) / texture_m[0]))
    size = np.stack([times, np.full(len(times), (z_m[1] - z_m[0]) / texture_m[1])], axis=1)
    mesh = quads(corners, material, size)
    # The foot of the texture, with its doors, is the foot of the wall.
    mesh.uv[..., 1] += 1 - size[0, 1]
    return mesh


def plate(
    polygon: shapely.Polygon, z_m: float, material: int, origin_m: Sequence[float], texture_m: Sequence[float]
) -> Mesh:
    """A level polygon, facing up; ``origin_m`` is the upper left corner of its texture on the map."""
    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    flat = np.array([np.array(shapely.orient_polygons(p).exterior.coords)[:3] for p in pieces])
    flat = flat.reshape(-1, 3, 2)
    corners = np.concatenate([flat, np.full((len(flat), 3, 1), z_m)], axis=-1)
    uv = (flat - np.asarray(origin_m)) / (np.asarray(texture_m) * [1, -1])
    return Mesh(corners, uv, np.full(len(flat), material))
