"""Curved bodies: skins over rings of points, their smooth normals, and flat pictures thrown onto them."""

from collections.abc import Sequence
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from streetworld.engine.mesh import Mesh, ball

_SAME_M = 1e-4
_NO_AREA_M2 = 1e-9
_CREASE_RAD = 0.7
_HALVES = np.array([[0, 1, 2], [0, 2, 3]])


class ViewSide(IntEnum):
    """The views from which a body is painted."""

    RIGHT = 0
    LEFT = 1
    FRONT = 2
    BACK = 3
    TOP = 4
    UNDER = 5


def loft(
    rings: Float[np.ndarray, "r c 3"], material: Int[np.ndarray, "_ c"] | int, crease_rad: float = _CREASE_RAD
) -> Mesh:
    """The skin over closed rings, counter-clockwise seen from above, from the lowest to the highest.

    ``material`` is that of each piece (R - 1, C), between a ring and the next, a point and the next. Pieces
    without an area are left out. It is smooth but for edges that turn by more than a crease.
    """
    grid = _grid(*rings.shape[:2])
    kinds = np.repeat(np.broadcast_to(material, (rings.shape[0] - 1, rings.shape[1])).ravel(), 2)
    return _smoothed(Mesh(rings.reshape(-1, 3)[grid.corner], grid.uv, kinds), grid.pairs, crease_rad)


class _Grid(NamedTuple):
    """Triangles over rings of points: the index of each corner, its place on a texture, and its pairs."""

    corner: Int[np.ndarray, "m 3"]
    uv: Float[np.ndarray, "m 3 2"]
    pairs: "_Pairs"


class _Pairs(NamedTuple):
    """All pairs of a corner of a triangle (counted through) with a corner that lies at the same place."""

    mine: Int[np.ndarray, " p"]
    other: Int[np.ndarray, " p"]


@lru_cache(maxsize=64)
def _grid(rows: int, columns: int) -> _Grid:
    row, column = (g.ravel() for g in np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij"))
    after = (column + 1) % columns
    around = [(row, column, column), (row, after, column + 1)]
    around += [(row + 1, after, column + 1), (row + 1, column, column)]
    index = np.stack([r * columns + c for r, c, _ in around], axis=-1)
    uv = np.stack([np.stack([u / columns, 1 - r / (rows - 1)], axis=-1) for r, _, u in around], axis=1)
    corner = index[:, _HALVES].reshape(-1, 3)
    return _Grid(corner, uv[:, _HALVES].reshape(-1, 3, 2), _pairs(corner.ravel()))


def _pairs(place: Int[np.ndarray, " n"]) -> _Pairs:
    """Pairs of corners whose places have the same number."""
    order = np.argsort(place, kind="stable")
    start = np.searchsorted(place[order], np.arange(place.max() + 2))
    members = (start[1:] - start[:-1])[place]
    mine = np.repeat(np.arange(len(place)), members)
    rank = np.arange(len(mine)) - np.repeat(np.cumsum(members) - members, members)
    return _Pairs(mine, order[start[place[mine]] + rank])


def smooth(mesh: Mesh, crease_rad: float = _CREASE_RAD) -> Mesh:
    """The same with normals at its corners: the mean over the triangles there that turn less.

    Triangles without an area are left out.
    """
    place = np.rint(mesh.corners.reshape(-1, 3) / _SAME_M).astype(np.int64)
    place -= place.min(axis=0)
    span = place.max(axis=0) + 1
    _, number = np.unique((place[:, 0] * span[1] + place[:, 1]) * span[2] + place[:, 2], return_inverse=True)
    return _smoothed(mesh, _pairs(number), crease_rad)


def _smoothed(mesh: Mesh, pairs: _Pairs, crease_rad: float) -> Mesh:
    """The triangles that have an area, with the mean normals over pairs, weighted by angle."""
    ahead = mesh.corners[:, (1, 2, 0)] - mesh.corners
    across = _cross(ahead[:, 0], -ahead[:, 2])
    double = np.sqrt(np.einsum("mi,mi->m", across, across))
    shown = double > _NO_AREA_M2
    flat = across / np.maximum(double, _NO_AREA_M2)[:, None]
    cos = -np.einsum("mci,mci->mc", ahead, ahead[:, (2, 0, 1)])
    weight = np.arctan2(double[:, None], cos) * shown[:, None]
    mine, other = pairs
    theirs = flat[other // 3]
    alike = np.einsum("ni,ni->n", flat[mine // 3], theirs) > np.cos(crease_rad)
    theirs *= (weight.ravel()[other] * alike)[:, None]
    total = np.stack([np.bincount(mine, theirs[:, k], 3 * len(mesh)) for k in range(3)], axis=-1)
    total /= np.maximum(np.sqrt(np.einsum("ni,ni->n", total, total)), 1e-12)[:, None]
    return Mesh(mesh.corners[shown], mesh.uv[shown], mesh.material[shown], total.reshape(-1, 3, 3)[shown])


def _cross(a: Float[np.ndarray, "n 3"], b: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    (a0, a1, a2), (b0, b1, b2) = a.T, b.T
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def projected(mesh: Mesh, size_m: Sequence[float], materials: Sequence[int]) -> Mesh:
    """The same, its materials (those of ``ViewSide`` as of now) replaced by pictures seen from the six sides.

    A picture is as wide and as high as the box (length, width, height) that stands on z = 0, seen upright
    from its side; the top's has the front on its right.
    """
    length, width, height = size_m
    x, y, z = np.moveaxis(mesh.corners, -1, 0)
    along, across, up = x / length + 0.5, y / width + 0.5, 1 - z / height
    places = [(along, up), (1 - along, up), (across, up), (1 - across, up), (along, 1 - across)]
    places.append(places[-1])
    uv = mesh.uv.copy()
    for side, (u, v) in enumerate(places):
        mine = mesh.material == side
        uv[mine] = np.stack([u[mine], v[mine]], axis=-1)
    return Mesh(mesh.corners, uv, np.asarray(materials)[mesh.material], mesh.normals)


def tube(
    centres: Float[np.ndarray, "r 3"],
    radii: Float[np.ndarray, "r 2"],
    material: int,
    sides: int = 8,
    power: float = 2.0,
) -> Mesh:
    """An upright body round centres from low to high, with its radii along x and y there.

    Sections are ellipses for a power of 2 and near rectangles for high ones.
    """
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False) + np.pi / sides
    cos, sin = np.cos(turn), np.sin(turn)
    grow = (np.abs(cos) ** power + np.abs(sin) ** power) ** (-1 / power)
    section = np.stack([cos * grow, sin * grow], axis=-1)
    rings = np.zeros((len(centres), sides, 3))
    rings[..., :2] = section * np.asarray(radii)[:, None]
    return loft(rings + np.asarray(centres)[:, None], material)


def capsule(length_m: float, radii_m: tuple[float, float], material: int) -> Mesh:
    """A limb from the origin down, rounded at both ends; radii are those at its upper and lower end."""
    upper, lower = radii_m
    rounding = np.array([0.0, 0.85, 1.0, 1.0, 0.85, 0.0])
    ends = np.array([lower] * 3 + [upper] * 3)
    height = np.array([-0.9, -0.5, 0.0, 0.0, 0.5, 0.9]) * ends
    height[:3] -= length_m
    unit, ring, grid_uv, normals = _unit_capsule()
    corners = unit * (rounding * ends)[ring][..., None]
    corners[..., 2] = height[ring]
    return Mesh(corners, grid_uv, np.full(len(unit), material), normals)


@lru_cache(maxsize=1)
def _unit_capsule() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Corners on the unit circle, the ring of each, textures and normals."""
    sides = 8
    grid = _grid(6, sides)
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring, column = grid.corner // sides, grid.corner % sides
    unit = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)[column]
    # No triangles in the points at the ends.
    shown = ~((ring == 0).sum(1) > 1) & ~((ring == 5).sum(1) > 1)
    rise = np.array([-1.0, -0.6, 0.0, 0.0, 0.6, 1.0])[ring]
    normals = unit * np.sqrt(1 - rise**2)[..., None]
    normals[..., 2] = rise
    return unit[shown], ring[shown], grid.uv[shown], normals[shown]


def bar(
    start_m: Sequence[float], end_m: Sequence[float], radii_m: tuple[float, float], material: int
) -> Mesh:
    """A thin round bar between two points, open at its ends; radii are those there."""
    start, end = np.array(start_m, dtype=np.float64), np.array(end_m, dtype=np.float64)
    unit, at_start, uv = _unit_bar()
    corners = unit * np.where(at_start, *radii_m)[..., None]
    corners[..., 2] = np.where(at_start, 0.0, -np.linalg.norm(end - start))
    return Mesh(corners, uv, np.full(len(unit), material), unit).moved(strip(start, end))


@lru_cache(maxsize=1)
def _unit_bar() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners on the unit circle, whether each lies at the upper end, and textures."""
    sides = 6
    grid = _grid(2, sides)
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    unit = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)[grid.corner % sides]
    return unit, grid.corner >= sides, grid.uv


def egg(centre_m: Sequence[float], radii_m: Sequence[float], material: int) -> Mesh:
    """A smooth ellipsoid."""
    unit = _unit_ball()
    normals = unit.corners / np.asarray(radii_m)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    corners = unit.corners * np.asarray(radii_m) + np.asarray(centre_m)
    return Mesh(corners, unit.uv, np.full(len(unit), material), normals)


@lru_cache(maxsize=1)
def _unit_ball() -> Mesh:
    return smooth(ball((0, 0, 0), (1, 1, 1), 0, 6))


def ring_wheel(radius_m: float, thickness_m: float, material: int, turns: int = 20) -> Mesh:
    """A tyre without its disc, around the y axis."""
    turn = np.linspace(0, 2 * np.pi, turns, endpoint=False)
    half = 0.5 * thickness_m
    section = [(-half, 0.0), (0.0, half), (half, 0.0), (0.0, -half), (-half, 0.0)]  # across, outwards
    rings = np.stack(
        [
            np.stack(
                [
                    (radius_m - half + out) * np.cos(turn),
                    0 * turn + across,
                    (radius_m - half + out) * np.sin(turn),
                ],
                -1,
            )
            for across, out in section
        ]
    )
    return loft(rings, material)


def strip(start_m: Float[np.ndarray, "3"], end_m: Float[np.ndarray, "3"]) -> Float[np.ndarray, "4 4"]:
    """Pose of a limb that hangs along -z, so that it leads from one point to another."""
    up = (start_m - end_m) / max(float(np.linalg.norm(start_m - end_m)), 1e-9)
    left = np.cross(up, [1.0, 0, 0.3])
    left /= max(float(np.linalg.norm(left)), 1e-9)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([np.cross(left, up), left, up], axis=-1)
    pose[:3, 3] = start_m
    return pose
