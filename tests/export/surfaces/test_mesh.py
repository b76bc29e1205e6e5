"""Meshes as trimesh reads them, of surfaces that are known."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.export import SurfaceMesh, mesh_of, scene_to_mesh
from dreamdrive.export.surfaces.fusion import _once, fuse
from dreamdrive.export.surfaces.mesh import left_out_of_mesh
from dreamdrive.export.surfaces.surface import Surface, surface_of
from dreamdrive.progress import silent
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from tests.export.surfaces.boards import CAR_M, PINHOLE, WALL_M, boards

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("skimage", reason="needs the extra mesh")
HEIGHT_M = 1.5


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The wall with a hole of 2 m x 2 m, and the car that moves before it."""
    made = boards()
    x, y = made.static.means[:, 0], made.static.means[:, 1]
    hole = (x > 1) & (x < 3) & (y > 1) & (y < 3)
    return replace(made, static=made.static.select(~hole))


@pytest.fixture(scope="module")
def mesh(scene: Scene) -> SurfaceMesh:
    return mesh_of(scene)


def middles(mesh: SurfaceMesh) -> np.ndarray:
    return mesh.places_m[mesh.triangles].mean(axis=1)


def test_a_wall_is_where_it_stands_and_nothing_else_is(mesh: SurfaceMesh) -> None:
    assert len(mesh.triangles) > 500
    np.testing.assert_allclose(mesh.places_m[:, 2], WALL_M, atol=0.05)
    assert abs(np.median(mesh.places_m[:, 2]) - WALL_M) < 0.01
    # The car stands in the way in all views but aside: what they see past it is filled, and no car is there.
    assert np.abs(mesh.places_m[:, 2] - CAR_M).min() > 1
    assert mesh.places_m[:, 1].min() > -0.2


def test_what_is_open_stays_open(mesh: SurfaceMesh) -> None:
    x, y, _ = middles(mesh).T
    assert not ((x > 1.25) & (x < 2.75) & (y > 1.25) & (y < 2.75)).any()
    around = (x > 0.5) & (x < 3.5) & (y > 0.5) & (y < 3.5)
    assert around.sum() > 100


def test_its_outside_is_where_cameras_are(mesh: SurfaceMesh) -> None:
    a, b, c = (mesh.places_m[mesh.triangles[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] < 0).all()


def test_colours_are_those_that_are_seen(scene: Scene, mesh: SurfaceMesh) -> None:
    seen = PINHOLE.project(mesh.places_m)
    inside = np.flatnonzero(PINHOLE.shows(seen))
    column, row = seen[inside, :2].astype(int).T
    shown = surface_of(scene, PINHOLE, 0.0, part="static").colour[row, column]
    off = np.abs(mesh.colours[inside] - shown)
    assert off.mean() < 0.05 < shown.std()


def test_neighbouring_blocks_are_joined(mesh: SurfaceMesh) -> None:
    """No corner is there twice, and no triangle has no area."""
    cells = np.rint(mesh.places_m * 1000).astype(int)
    assert len(np.unique(cells, axis=0)) == len(cells)
    assert len(np.unique(mesh.triangles)) == len(cells)
    made = trimesh.Trimesh(mesh.places_m, mesh.triangles, process=False)
    assert len(made.split(only_watertight=False)) == 1


def test_a_road_at_a_grazing_angle_is_whole() -> None:
    """Along the ray, distances to it would be ten times too large, and leave holes between cells."""
    camera = Camera(300.0, 300.0, 160.0, 60.0, 320, 192)
    down = camera.rays()[..., 1]
    depth_m = np.where(down > 0.02, HEIGHT_M / np.maximum(down, 0.02), 0.0)
    surface = Surface(camera, np.zeros((*down.shape, 3)), depth_m, np.zeros((*down.shape, 3)), down < 0)
    places_m, triangles = fuse([surface], 0.15, 30.0, silent)
    x, y, z = places_m[triangles].mean(axis=1).T
    near = (np.abs(x) < 2) & (z > 5) & (z < 20)
    np.testing.assert_allclose(y[near], HEIGHT_M, atol=0.1)
    assert np.median(np.abs(y[near] - HEIGHT_M)) < 0.02
    a, b, c = (places_m[triangles[near, k]] for k in range(3))
    flat = np.cross(b - a, c - a)[:, 1]
    assert -0.5 * flat.sum() == pytest.approx(4 * 15, rel=0.05)


def test_ply_is_read_by_trimesh(scene: Scene, mesh: SurfaceMesh, tmp_path: Path) -> None:
    scene_to_mesh(scene, tmp_path / "street.ply")
    found = trimesh.load(tmp_path / "street.ply", process=False)
    np.testing.assert_allclose(found.vertices, mesh.places_m, atol=1e-5)
    np.testing.assert_array_equal(found.faces, mesh.triangles)
    np.testing.assert_array_equal(found.visual.vertex_colors[:, :3], np.rint(mesh.colours * 255))


def test_glb_is_read_by_trimesh_with_y_up(scene: Scene, mesh: SurfaceMesh, tmp_path: Path) -> None:
    scene_to_mesh(scene, tmp_path / "street.glb")
    (found,) = trimesh.load(tmp_path / "street.glb", process=False).geometry.values()
    np.testing.assert_allclose(found.vertices, mesh.places_m * [1, -1, -1], atol=1e-5)
    np.testing.assert_array_equal(found.faces, mesh.triangles)
    linear = np.asarray(found.visual.vertex_attributes["color"])[:, :3] / 255
    back = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    # A byte of linear light is a coarse step where it is dark.
    np.testing.assert_allclose(back, mesh.colours, atol=0.05)


def test_nothing_within_reach_is_said(scene: Scene, tmp_path: Path) -> None:
    away = replace(scene.static, means=scene.static.means + torch.tensor([0.0, 0.0, 90.0]))
    with pytest.raises(InputError, match="nothing stands within 40 m"):
        scene_to_mesh(replace(scene, static=away), tmp_path / "a.ply")
    with pytest.raises(InputError, match="nothing stands within 40 m"):
        scene_to_mesh(replace(scene, static=scene.static.select(torch.arange(0))), tmp_path / "a.ply")
    assert list(tmp_path.iterdir()) == []


def test_what_is_left_out_is_said(scene: Scene) -> None:
    assert "nothing that moves" in left_out_of_mesh(scene, Path("a.ply"))
    assert "nothing that moves" not in left_out_of_mesh(
        replace(scene, dynamic=scene.dynamic.select(torch.arange(0))), Path("a.ply")
    )


def test_the_package_is_asked_for(scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "skimage", None)
    with pytest.raises(InputError, match=r"-e '.\[mesh\]'"):
        scene_to_mesh(scene, tmp_path / "a.ply")


def test_rows_once() -> None:
    rows = np.array([[3, -5, 7], [1, 2, 3], [3, -5, 7]])
    once, first, to = _once(rows)
    assert sorted(map(tuple, once.tolist())) == [(1, 2, 3), (3, -5, 7)]
    np.testing.assert_array_equal(rows[first], once)
    np.testing.assert_array_equal(once[to], rows)
    assert _once(np.zeros((0, 3), int))[0].shape == (0, 3)
