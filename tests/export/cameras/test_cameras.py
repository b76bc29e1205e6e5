"""Cameras of a scene for other programs: read back by pycolmap, and by our own readers."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest
from scipy.spatial.transform import Rotation

from dreamdrive import Scene
from dreamdrive.data import read_trajectory
from dreamdrive.errors import InputError
from dreamdrive.export import export, scene_to_colmap, scene_to_nerfstudio, scene_to_tum
from dreamdrive.export.cameras import views
from dreamdrive.scene.clip import Clip
from dreamdrive.splat import render_scene
from tests.scene.scenes import make_scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Three views, two of them of a second camera, on a path that turns."""
    made = make_scene()
    poses = [np.eye(4) for _ in range(3)]
    for k, pose in enumerate(poses):
        pose[:3, :3] = Rotation.from_rotvec([0.1 * k, 0.3 * k, 0.0]).as_matrix()
        pose[:3, 3] = [0.1 * k, 0.0, 0.5 * k]
    cameras = tuple(replace(c, world_from_camera=p) for c, p in zip(made.cameras, poses, strict=True))
    wider = tuple(replace(c, fx_px=40.0) for c in cameras[1:])
    return replace(made, cameras=(cameras[0], *wider), camera=np.array([0, 1, 1]))


@pytest.fixture(scope="module")
def written(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cameras")
    export(scene, "colmap", folder / "colmap")
    export(scene, "nerfstudio", folder / "nerfstudio")
    return folder


def test_colmap_reads_cameras_poses_and_points(scene: Scene, written: Path) -> None:
    model = pycolmap.Reconstruction(str(written / "colmap" / "sparse" / "0"))
    assert (model.num_cameras(), model.num_images()) == (2, 3)
    for i, camera in enumerate(scene.cameras):
        image = model.images[i + 1]
        np.testing.assert_allclose(image.cam_from_world().matrix(), camera.camera_from_world[:3], atol=1e-12)
        assert image.camera.model.name == "PINHOLE"
        assert image.camera.params.tolist() == [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px]
        picture = cv2.imread(str(written / "colmap" / "images" / image.name))
        assert picture is not None
        seen = render_scene(scene, camera, float(scene.times_s[i]), of_rig=[0, 1, 1][i]).picture
        np.testing.assert_array_equal(picture[..., ::-1], seen)
    means_m, colours = views.street_points(scene)
    assert 0 < len(means_m) == model.num_points3D() < len(scene.static)
    points = [model.points3D[k + 1] for k in range(len(means_m))]
    np.testing.assert_allclose([point.xyz for point in points], means_m)
    np.testing.assert_array_equal([point.color for point in points], colours)


def test_nerfstudio_has_cameras_of_opengl_and_points(scene: Scene, written: Path) -> None:
    told = json.loads((written / "nerfstudio" / "transforms.json").read_text())
    for i, (frame, camera) in enumerate(zip(told["frames"], scene.cameras, strict=True)):
        pose = np.array(frame["transform_matrix"]) * [1, -1, -1, 1]
        np.testing.assert_allclose(pose, camera.world_from_camera)
        assert [frame[name] for name in ("fl_x", "fl_y", "w", "h")] == [camera.fx_px, camera.fy_px, 33, 24]
        assert frame["time"] == scene.times_s[i]
        assert (written / "nerfstudio" / frame["file_path"]).is_file()
    assert told["test_filenames"] == ["images/camera1/00001.png"]
    assert len(told["train_filenames"]) == 2
    data = (written / "nerfstudio" / told["ply_file_path"]).read_bytes()
    head, _, body = data.partition(b"end_header\n")
    means_m, colours = views.street_points(scene)
    assert f"element vertex {len(means_m)}\n".encode() in head
    rows = list(struct.iter_unpack("<3f3B", body))
    np.testing.assert_allclose([row[:3] for row in rows], means_m, rtol=1e-6)
    np.testing.assert_array_equal([row[3:] for row in rows], colours)


def test_the_path_is_read_back(scene: Scene, tmp_path: Path) -> None:
    scene_to_tum(scene, tmp_path / "path.txt")
    read = read_trajectory(tmp_path / "path.txt")
    np.testing.assert_allclose(read.world_from_camera, scene.trajectory.world_from_camera, atol=1e-6)
    np.testing.assert_allclose(read.times_s, scene.trajectory.times_s)
    with pytest.raises(InputError, match="exists already"):
        scene_to_tum(scene, tmp_path / "path.txt")
    scene_to_tum(scene, tmp_path / "path.txt", replace=True)


def test_frames_of_the_clip_are_written_as_they_are(scene: Scene, tmp_path: Path) -> None:
    frames = np.random.default_rng(0).integers(0, 255, (3, 24, 33, 3), np.uint8)
    clip = Clip(
        frames=frames,
        times_s=scene.times_s,
        camera=np.array([0, 1, 1]),
        rig=scene.cameras[:2],
        valid=np.ones(frames.shape[:3], bool),
        held_out=scene.held_out,
        source_index=np.arange(3),
    )
    scene_to_colmap(scene, tmp_path / "colmap", clip=clip)
    picture = cv2.imread(str(tmp_path / "colmap" / "images" / "camera1" / "00002.png"))
    assert picture is not None
    np.testing.assert_array_equal(picture[..., ::-1], frames[2])
    with pytest.raises(InputError, match="not those of the scene"):
        scene_to_nerfstudio(scene, tmp_path / "other", clip=replace(clip, times_s=clip.times_s + 1))
    assert not (tmp_path / "other").exists()
