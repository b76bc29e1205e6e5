"""Curved bodies: skins over rings of points, their smooth normals, and flat pictures thrown onto them."""

from collections.abc import Sequence
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.world.mesh import Mesh, quads

_SAME_M = 1e-4


class Side(IntEnum):
    """The views from which a body is painted."""

    RIGHT = 0
    LEFT = 1
    FRONT = 2
    BACK = 3
    TOP = 4
    UNDER = 5


def loft(rings: Float[np.ndarray, "r c 3"], material: Int[np.ndarray, "_ c"] | int) -> Mesh:
    """The skin over closed rings, counter-clockwise seen from above, from the lowest to the highest.

    ``material`` is that of each piece (R - 1, C), between a ring and the next, a point and the next. Pieces
    without an area are left out.
    """
    after = np.roll(rings, -1, axis=1)
    corners = np.stack([rings[:-1], after[:-1], after[1:], rings[1:]], axis=2).reshape(-1, 4, 3)
    kinds = np.broadcast_to(material, (rings.shape[0] - 1, rings.shape[1])).ravel()
    u, v = np.linspace(0, 1, rings.shape[1] + 1), np.linspace(1, 0, rings.shape[0])
    left, low = (g.ravel() for g in np.meshgrid(u[:-1], v[:-1]))
    right, high = (g.ravel() for g in np.meshgrid(u[1:], v[1:]))
    uv = np.stack([np.stack(p, -1) for p in ((left, low), (right, low), (right, high), (left, high))], axis=1)
    mesh = quads(corners, kinds)
    pick = np.array([[0, 1, 2], [0, 2, 3]])
    return solid_part(Mesh(mesh.corners, uv[:, pick].reshape(-1, 3, 2), mesh.material))


def solid_part(mesh: Mesh) -> Mesh:
    """The triangles that have an area."""
    edges = mesh.corners[:, 1:] - mesh.corners[:, :1]
    shown = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) > 1e-9
    return Mesh(mesh.corners[shown], mesh.uv[shown], mesh.material[shown])


def smooth(mesh: Mesh, crease_rad: float = 0.7) -> Mesh:
    """The same with normals at its corners: the mean over the triangles there that turn less.

    Triangles without an area are left out.
    """
    mesh = solid_part(mesh)
    count = len(mesh)
    flat = mesh.flat_normals()[:, 0]
    place = np.rint(mesh.corners.reshape(-1, 3) / _SAME_M).astype(np.int64)
    place -= place.min(axis=0)
    span = place.max(axis=0) + 1
    _, corner = np.unique((place[:, 0] * span[1] + place[:, 1]) * span[2] + place[:, 2], return_inverse=True)
    order = np.argsort(corner, kind="stable")
    start = np.searchsorted(corner[order], np.arange(corner.max() + 2))
    members = start[corner + 1] - start[corner]
    # All pairs of a corner of a triangle with each triangle at that place.
    mine = np.repeat(np.arange(3 * count), members)
    rank = np.arange(len(mine)) - np.repeat(np.cumsum(members) - members, members)
    other = order[start[corner[mine]] + rank] // 3
    alike = np.einsum("ni,ni->n", flat[mine // 3], flat[other]) > np.cos(crease_rad)
    weight = _angles(mesh.corners).ravel()[order[start[corner[mine]] + rank]] * alike
    total = np.stack([np.bincount(mine, weight * flat[other, k], 3 * count) for k in range(3)], axis=-1)
    total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
    return Mesh(mesh.corners, mesh.uv, mesh.material, total.reshape(-1, 3, 3))


def _angles(corners: Float[np.ndarray, "m 3 3"]) -> Float[np.ndarray, "m 3"]:
    """Angle of each triangle at each of its corners."""
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cos = np.einsum("mci,mci->mc", ahead, behind)
    sin = np.linalg.norm(np.cross(ahead, behind), axis=-1)
    return np.arctan2(sin, cos)


def projected(mesh: Mesh, size_m: Sequence[float], materials: Sequence[int]) -> Mesh:
    """The same, its materials (those of ``Side`` as of now) replaced by pictures seen from the six sides.

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


def capsule(length_m: float, radii_m: tuple[float, float], material: int, sides: int = 8) -> Mesh:
    """A limb from the origin down, rounded at both ends; radii are those at its upper and lower end."""
    upper, lower = radii_m
    z = np.array([-length_m - 0.9 * lower, -length_m - 0.5 * lower, -length_m, 0, 0.5 * upper, 0.9 * upper])
    r = np.array([0, 0.85 * lower, lower, upper, 0.85 * upper, 0])
    centres = np.zeros((6, 3))
    centres[:, 2] = z
    return tube(centres, np.stack([r, r], axis=-1), material, sides)


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
