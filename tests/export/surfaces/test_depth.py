"""Depth as other programs read it."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.export import export, scene_to_depth
from dreamdrive.export.surfaces.depth import depth_picture
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene
from tests.export.surfaces.boards import AHEAD_M, CAR_M, WALL_M, boards


@pytest.fixture(scope="module")
def scene() -> Scene:
    return boards()


@pytest.fixture(scope="module")
def written(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("depth") / "set"
    export(scene, "depth", folder)
    return folder


def depth_read(file: Path) -> np.ndarray:
    """As the development kit of KITTI's depth benchmark has it: not seen is -1."""
    picture = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    assert picture is not None
    assert picture.dtype == np.uint16
    depth_m = picture.astype(np.float64) / 256
    depth_m[picture == 0] = -1
    return depth_m


def test_a_wall_and_a_car_are_as_far_as_they_stand(written: Path) -> None:
    for frame in range(3):
        depth_m = depth_read(written / "depth" / f"{frame:05d}.png")
        # At outlines a pixel has the depth of one side, never one in between.
        near, far = CAR_M - frame * AHEAD_M, WALL_M - frame * AHEAD_M
        seen = np.unique(depth_m)
        assert all(min(abs(each / np.array([near, far, -1]) - 1)) < 0.06 for each in seen), seen
        assert depth_m[2, 48] == -1
        assert depth_m[60, 4] == pytest.approx(far, abs=1 / 256)
        car = np.abs(depth_m - near) < 0.05 * near
        assert 0.9 * (80 / near) ** 2 < car.sum() < 1.4 * (80 / near) ** 2


def test_pictures_and_cameras_lie_beside_it(scene: Scene, written: Path) -> None:
    about = json.loads((written / "transforms.json").read_text())
    assert about["depth_unit_scale_factor"] == 1 / 256
    for k, frame in enumerate(about["frames"]):
        assert (written / frame["depth_file_path"]).is_file()
        picture = cv2.imread(str(written / frame["file_path"]))
        assert picture is not None
        seen = render_scene(scene, scene.cameras[k], float(scene.times_s[k])).picture
        np.testing.assert_array_equal(picture[..., ::-1], seen)
        flipped = np.array(frame["transform_matrix"]) @ np.diag([1.0, -1, -1, 1])
        np.testing.assert_allclose(flipped, scene.cameras[k].world_from_camera)


def test_each_camera_of_a_rig_has_a_folder(scene: Scene, tmp_path: Path) -> None:
    scene_to_depth(replace(scene, camera=np.array([0, 1, 0])), tmp_path / "set")
    folder = tmp_path / "set" / "depth"
    names = sorted(file.relative_to(folder).as_posix() for file in folder.rglob("*.png"))
    assert names == ["camera0/00000.png", "camera0/00002.png", "camera1/00001.png"]


def test_what_is_too_far_is_not_known() -> None:
    found = depth_picture(np.array([[0.0, 1.0, 255.99, 255.9985, 300.0]]))
    assert found.tolist() == [[0, 256, 65533, 0, 0]]
