"""Meshes on hills."""

import numpy as np
import pytest

from dreamdrive.scene.street.hills import Hills
from dreamdrive.scene.street.layout import Relief
from streetworld.engine.hills import lifted
from streetworld.engine.mesh import Mesh, quads

HILLS = Hills(Relief(4.0, 150.0), 5)


def ground(reach_m: float = 300.0) -> Mesh:
    corner = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * reach_m
    return quads(corner[None], 0)


def test_a_mesh_follows_the_ground() -> None:
    hilly = lifted(HILLS, ground())
    flat = hilly.corners.reshape(-1, 3)
    np.testing.assert_allclose(flat[:, 2], HILLS.height_m(flat[:, :2]))
    middle = hilly.corners.mean(axis=1)
    near = np.linalg.norm(middle[:, :2], axis=1) < 60
    assert np.abs(middle[near, 2] - HILLS.height_m(middle[near, :2])).max() < 0.05
    # Textures stay where they were.
    np.testing.assert_allclose(hilly.uv.reshape(-1, 2), (flat[:, :2] * [1, -1] + 300) / 600, atol=1e-9)


def test_a_mesh_has_no_gaps_where_it_is_divided() -> None:
    hilly = lifted(HILLS, ground())
    corners = np.round(hilly.corners, 6)
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    ordered = np.array([sorted(map(tuple, edge)) for edge in edges]).reshape(-1, 6)
    _, count = np.unique(ordered, axis=0, return_counts=True)
    outer = (np.abs(edges[:, :, :2]) > 299.99).all(axis=1).any(axis=1)
    assert (count == 1).sum() == outer.sum()
    a, b = (hilly.corners[:, k, :2] - hilly.corners[:, 0, :2] for k in (1, 2))
    area = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    assert (area > 0).all()
    assert area.sum() == pytest.approx(600**2)


def test_level_land_leaves_a_mesh_as_it_is() -> None:
    mesh = ground()
    assert lifted(Hills(Relief(), 0), mesh) is mesh
