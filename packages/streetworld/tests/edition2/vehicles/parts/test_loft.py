"""Curved bodies: their normals and how they are shaded."""

import numpy as np
from embreex.rtcore import EmbreeDevice

from dreamdrive.scene.level import upright
from streetworld.edition2.vehicles.parts.loft import bar, capsule, egg, loft, smooth, strip, tube
from streetworld.engine.mesh import Mesh, ball, box
from streetworld.engine.solid import Solid


def interpolated(mesh: Mesh, points: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    solid = Solid(mesh, np.zeros(len(mesh), dtype=np.int64), EmbreeDevice())
    assert solid.to_normal is not None
    rows = solid.to_normal[triangle]
    return np.einsum("nki,ni->nk", rows[..., :3], points) + rows[..., 3]


def test_normals_between_corners_are_those_of_the_ball() -> None:
    mesh = smooth(ball((3, -2, 1), (1, 1, 1), 0, 12))
    weights = np.random.default_rng(0).dirichlet(np.ones(3), len(mesh))
    points = np.einsum("mc,mci->mi", weights, mesh.corners)
    found = interpolated(mesh, points, np.arange(len(mesh)))
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    true = points - [3, -2, 1]
    true /= np.linalg.norm(true, axis=1, keepdims=True)
    assert np.einsum("mi,mi->m", found, true).min() > np.cos(np.deg2rad(5))


def test_edges_that_turn_by_more_than_a_crease_stay_sharp() -> None:
    mesh = smooth(box((0, 0, 0), (1, 1, 1), 0))
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, mesh.flat_normals(), atol=1e-12)
    solid = Solid(mesh, np.zeros(len(mesh), dtype=np.int64), EmbreeDevice())
    assert solid.curved is not None
    assert not solid.curved.any()


def test_normals_turn_with_their_mesh() -> None:
    mesh = egg((0, 0, 1), (1, 2, 0.5), 0).moved(upright((4.0, 1.0, 0.7)))
    assert mesh.normals is not None
    assert np.einsum("mci,mci->mc", mesh.normals, mesh.flat_normals()).min() > 0.6


def test_flat_and_smooth_meshes_join() -> None:
    flat, curved = box((0, 0, 0), (1, 1, 1), 0), egg((0, 0, 1), (1, 1, 1), 0)
    joined = Mesh.joined([flat, curved])
    assert joined.normals is not None
    np.testing.assert_array_equal(joined.normals[: len(flat)], flat.flat_normals())
    assert Mesh.joined([flat, flat]).normals is None


def test_prepared_limbs_face_outwards() -> None:
    centres = np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 1], [0, 0, 1]])
    radii = np.array([[0.0, 0], [0.4, 0.3], [0.3, 0.3], [0, 0]])
    for mesh in (
        capsule(0.5, (0.1, 0.05), 0),
        tube(centres, radii, 0),
        bar((0, 0, 0), (0.5, 1, 2), (0.1, 0.2), 0),
    ):
        assert mesh.normals is not None
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=-1), 1, atol=1e-9)
        assert np.einsum("mci,mci->mc", mesh.normals, mesh.flat_normals()).min() > 0.3


def test_pieces_without_an_area_are_left_out() -> None:
    turn = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
    cone = loft(np.stack([ring, ring * 0 + [0, 0, 1.0]]), 0)
    assert len(cone) == 8


def test_a_limb_leads_from_joint_to_joint() -> None:
    start, end = np.array([0.3, -0.2, 1.0]), np.array([0.5, 0.1, 0.4])
    pose = strip(start, end)
    length = float(np.linalg.norm(end - start))
    np.testing.assert_allclose((pose @ [0, 0, -length, 1])[:3], end, atol=1e-12)
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose[:3, :3]) > 0
