from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.data import write_trajectory
from dreamdrive.data.splats.read_splats import Up, down_from
from dreamdrive.data.splats.splat_scene import read_splat_scene
from dreamdrive.errors import InputError
from dreamdrive.export import export
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene
from dreamdrive.stored import load_scene


def _bare(folder: Path) -> Scene:
    """Of a run, what a still format holds of its first time."""
    scene = load_scene(folder / "scene")
    return replace(scene, sky=None, exposure=None)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "least_db"), [("ply", 60), ("glb", 60), ("spz", 30)])
def test_a_scene_that_went_out_comes_back(finished: Path, tmp_path: Path, kind: str, least_db: float) -> None:
    scene = _bare(finished)
    export(scene, kind, tmp_path / f"a.{kind}")
    drive = scene.trajectory
    if kind != "ply":
        turn = np.diag([1.0, -1, -1, 1])
        drive = replace(drive, world_from_camera=turn @ drive.world_from_camera)
    write_trajectory(drive, tmp_path / "drive.json")
    read = read_splat_scene(tmp_path / f"a.{kind}", cameras=tmp_path / "drive.json")
    assert read.dropped == 0
    t_s = float(scene.times_s[0])
    for index in (0, len(scene.cameras) - 1):
        camera = scene.cameras[index]
        there = read.scene.cameras[index]
        assert np.allclose(there.world_from_camera, camera.world_from_camera, atol=1e-6)
        true = render_scene(scene, camera, t_s).colour
        found = render_scene(read.scene, camera, t_s).colour
        assert -10 * np.log10(float((true - found).square().mean()) + 1e-12) > least_db


def test_views_of_a_colmap_model_are_taken(finished: Path, tmp_path: Path) -> None:
    scene = load_scene(finished / "scene")
    export(scene, "ply", tmp_path / "a.ply")
    export(scene, "colmap", tmp_path / "model")
    read = read_splat_scene(tmp_path / "a.ply", cameras=tmp_path / "model").scene
    assert len(read.cameras) == len(scene.cameras)
    for found, true in zip(read.cameras, scene.cameras, strict=True):
        assert np.allclose(found.world_from_camera, true.world_from_camera, atol=1e-5)
        assert (found.width_px, found.fx_px) == (true.width_px, pytest.approx(true.fx_px))


@pytest.mark.parametrize("kind", ["ply", "glb"])
def test_without_cameras_views_stand_around_and_upright(finished: Path, tmp_path: Path, kind: str) -> None:
    scene = load_scene(finished / "scene")
    export(scene, kind, tmp_path / f"a.{kind}")
    read = read_splat_scene(tmp_path / f"a.{kind}")
    assert np.array_equal(read.scene.cameras[0].world_from_camera, np.eye(4))
    # The road of the scene is down in each view, whatever the axes of the file.
    up = np.array(read.scene.provenance.up)
    for camera in read.scene.cameras:
        _, down, _ = camera.world_from_camera[:3, :3].T
        assert down @ up < -0.9
        middle = np.median(read.scene.static.means.numpy(), axis=0)
        column, row, depth_m = camera.project(middle[None].astype(float))[0]
        assert depth_m > 0
        assert (column, row) == (pytest.approx(camera.cx_px, abs=30), pytest.approx(camera.cy_px, abs=30))
    assert render_scene(read.scene, read.scene.cameras[3], 0.0).alpha.max() > 0.5


@pytest.mark.parametrize("up", ["x", "-x", "y", "-y", "z", "-z"])
def test_each_axis_can_point_up(up: Up) -> None:
    axis = np.eye(3)["xyz".index(up[-1])] * (-1 if up.startswith("-") else 1)
    rotation = down_from(up)
    assert np.allclose(rotation @ axis, [0, -1, 0])
    assert np.isclose(np.linalg.det(rotation), 1)
    assert np.allclose(rotation @ rotation.T, np.eye(3))


def test_what_cannot_be_read_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0")
    with pytest.raises(InputError, match=r"ends in '\.obj'"):
        read_splat_scene(tmp_path / "a.obj")
    (tmp_path / "a.ply").write_text("")
    with pytest.raises(InputError, match="no header of PLY"):
        read_splat_scene(tmp_path / "a.ply")
