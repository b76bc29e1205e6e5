"""Videos and held-out frames: the right number, size, rate and distortion."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.data import SourceLens
from dreamdrive.data.cameras.distortion import Distortion
from dreamdrive.drive.manoeuvres import frame_rate, manoeuvre, smooth
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.show import videos
from dreamdrive.show.videos import _surround, as_recorded, lens_of, write_held_out, write_videos
from tests.scene.scenes import make_scene


def distorted(scene: Scene) -> Scene:
    lens = SourceLens(Distortion("opencv", (-0.3, 0.05, 0.0, 0.0)), scene.cameras[0])
    return replace(scene, provenance=Provenance(lens=lens.to_json(), up=(0.0, -0.8, 0.6)))


def test_held_out_frames_carry_their_source_index_and_size(tmp_path: Path) -> None:
    write_held_out(tmp_path, make_scene(), [20, 22, 24])
    assert [p.name for p in tmp_path.iterdir()] == ["0022.png"]
    image = cv2.imread(str(tmp_path / "0022.png"))
    assert image is not None
    assert image.shape == (24, 33, 3)


def test_a_drive_from_aside_is_written_where_one_is_wanted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, drives = make_scene(), dict[str, np.ndarray]()

    def keep(path: Path, frames: Iterator[np.ndarray], fps: float) -> None:
        drives[path.stem] = np.stack(list(frames))

    monkeypatch.setattr(videos, "write_video", keep)
    recorded = np.zeros((3, 24, 33, 3), np.uint8)
    steps: list[tuple[int, int]] = []
    write_videos(tmp_path, scene, recorded, None, lambda *step: steps.append(step), shift_m=None)
    assert list(drives) == ["drive", "recorded_beside_rendered", "panels"]
    assert steps[-1][0] == steps[-1][1] == len(steps)
    write_videos(tmp_path, scene, recorded, None, lambda *step: steps.append(step), shift_m=-2.0)
    assert list(drives)[-1] == "shift"
    assert steps[-1][0] == steps[-1][1]
    left = manoeuvre("shift", smooth(scene.trajectory), scene.up, -2.0)
    expected = as_recorded(
        scene, scene.cameras[0].at(left.world_from_camera[0]), float(left.times_s[0]), None
    )
    np.testing.assert_array_equal(drives["shift"][0], expected)


def test_views_carry_the_distortion_of_the_source(tmp_path: Path) -> None:
    scene = distorted(make_scene())
    lens = lens_of(scene)
    assert lens is not None
    camera = scene.cameras[0].at(np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -6], [0, 0, 0, 1.0]]))
    plain, bent = as_recorded(scene, camera, 0.4, None), as_recorded(scene, camera, 0.4, lens)
    assert plain.shape == bent.shape
    assert (plain != bent).any()
    # A barrel lens leaves the middle where it is and shows more at the rim, with no empty corners.
    assert np.abs(plain[10:14, 14:19].astype(int) - bent[10:14, 14:19]).mean() < 8
    assert lens.covered(lens.covering()).all()


def test_what_a_scene_remembers_of_its_making() -> None:
    scene = make_scene()
    assert lens_of(replace(scene, provenance=Provenance())) is None
    assert replace(scene, provenance=Provenance()).up.tolist() == [0, -1, 0]
    assert distorted(scene).up.tolist() == [0, -0.8, 0.6]


def test_drives_are_made_smooth_without_moving_recorded_frames() -> None:
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, 2, 3] = [0, 1, 3, 6, 10]
    path = Trajectory(poses, np.arange(5) / 5)
    fine = smooth(path)
    assert frame_rate(path) == 5
    assert round(frame_rate(fine), 6) == 20
    assert len(fine) == 17
    np.testing.assert_allclose(fine.world_from_camera[::4], poses, atol=1e-9)
    assert frame_rate(Trajectory(poses[:1], np.zeros(1))) == 10


def test_of_a_rig_the_other_cameras_carry_their_number(tmp_path: Path) -> None:
    scene = replace(make_scene(), camera=np.array([0, 1, 0]), exposure=None)
    write_held_out(tmp_path, scene, [4, 4, 5])
    assert [path.name for path in tmp_path.iterdir()] == ["0004_camera1.png"]


def test_all_cameras_of_a_rig_are_shown_in_one_picture() -> None:
    """What looks ahead is above, from left to right; what looks back below."""
    scene, turned = make_scene(), [0.0, 1.0, -1.0, np.pi]
    cameras = []
    for yaw in turned:
        pose = np.eye(4)
        pose[:3, :3] = cv2.Rodrigues(np.array([0.0, yaw, 0.0]))[0]
        cameras.append(scene.cameras[0].at(pose))
    rig = np.arange(4)
    scene = replace(
        scene, cameras=tuple(cameras), times_s=np.zeros(4), held_out=rig < 0, camera=rig, exposure=None
    )
    picture = next(_surround(scene, rig))
    height, width = scene.cameras[0].height_px, scene.cameras[0].width_px
    assert picture.shape == (2 * height, 3 * width, 3)
    order = [2, 0, 1]
    for column, camera in enumerate(order):
        shown = picture[:height, column * width : (column + 1) * width]
        np.testing.assert_array_equal(shown, as_recorded(scene, scene.cameras[camera], 0.0, None, camera))
    assert (picture[height:, width:] == 0).all()
