"""Sequences of KITTI's odometry benchmark as logs."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.datasets.kitti import KITTI_ODOMETRY, read_kitti_odometry
from dreamdrive.datasets.kitti.odometry import EGO_FROM_CAMERA_0
from dreamdrive.errors import InputError
from dreamdrive.scene.street.log import Log
from tests.data.cameras.test_fitted import halved
from tests.datasets.kitti.conftest import (
    CAMERA_FROM_LIDAR,
    COUNT,
    RECTIFIED,
    SIZE,
    Small,
    camera_0_from,
    camera_poses,
    line,
    write_pictures,
)


def read(small: Small) -> Log:
    return read_kitti_odometry(small.odometry, "04")


def test_the_folder_and_a_sequence_are_recognised(small: Small) -> None:
    assert KITTI_ODOMETRY.logs is not None
    shutil.copytree(small.odometry, small.root / "unpacked" / "dataset")
    for path in (small.odometry, small.sequence, small.root / "unpacked"):
        assert KITTI_ODOMETRY.recognises(path)
        assert KITTI_ODOMETRY.logs.names(path) == ("04",)
        assert read_kitti_odometry(path, "04").name == "04"
    assert not KITTI_ODOMETRY.recognises(small.root / "raw")
    assert not KITTI_ODOMETRY.recognises(small.sequence / "image_2")
    with pytest.raises(InputError, match="no sequence 05"):
        read_kitti_odometry(small.odometry, "05")


def test_the_drive_is_that_of_the_files(small: Small) -> None:
    log = read(small)
    assert log.problems == ()
    assert log.boxes == ()
    np.testing.assert_allclose(log.times_s, 0.1 * np.arange(COUNT))
    np.testing.assert_allclose(log.world_from_ego[0], np.eye(4), atol=1e-9)
    # 1 m a frame ahead; a turn to the right is one to the negative about z.
    np.testing.assert_allclose(log.world_from_ego[1, :3, 3], [1, -0.05, 0], atol=1e-9)
    np.testing.assert_allclose(log.world_from_ego[1, :3, 0], [np.cos(0.1), -np.sin(0.1), 0], atol=1e-9)
    (camera,) = log.cameras
    assert camera.name == "image_2"
    wanted = EGO_FROM_CAMERA_0 @ np.array(camera_poses()) @ camera_0_from("02")
    np.testing.assert_allclose(camera.world_from_camera, wanted, atol=1e-9)
    np.testing.assert_allclose(camera.ego_from_camera[:3, 3], [0, 0.06, 1.65], atol=1e-9)
    assert (camera.pinhole.width_px, camera.pinhole.height_px) == SIZE
    assert (camera.pinhole.fx_px, camera.pinhole.cx_px, camera.pinhole.cy_px) == (50.0, 31.5, 12.0)


def test_sweeps_are_in_the_frame_of_the_lidar(small: Small) -> None:
    log = read(small)
    for step, sweep in enumerate(log.sweeps):
        wanted = EGO_FROM_CAMERA_0 @ camera_poses()[step] @ RECTIFIED @ CAMERA_FROM_LIDAR
        np.testing.assert_allclose(sweep.world_from_points, wanted, atol=1e-6)
    assert len(log.sweeps) == COUNT
    shutil.rmtree(small.sequence / "velodyne")
    assert (read(small).sweeps, read(small).problems) == ((), ())


def test_grey_cameras_are_taken_where_there_are_no_others(small: Small) -> None:
    write_pictures(small.sequence / "image_1", 6)
    assert [camera.name for camera in read(small).cameras] == ["image_2"]
    shutil.rmtree(small.sequence / "image_2")
    assert [camera.name for camera in read(small).cameras] == ["image_1"]


def test_a_clip_of_the_sequence(small: Small) -> None:
    clip = KITTI_ODOMETRY.read(small.sequence, size=SIZE)
    assert clip.frames.shape == (COUNT, SIZE[1], SIZE[0], 3)
    assert clip.known.world_from_camera is not None


def _calibration(start: str, instead: str = "") -> Callable[[Small], None]:
    def change(small: Small) -> None:
        path = small.sequence / "calib.txt"
        kept = [row for row in path.read_text().splitlines(True) if not row.startswith(start)]
        path.write_text("".join(kept) + instead)

    return change


@pytest.mark.parametrize(
    "damage",
    [_calibration("P3"), _calibration("P3", line("P3", [0] * 12)), _calibration("P3", "P3: 1 2 3\n")],
)
def test_a_camera_without_calibration_is_named_and_the_other_works(
    small: Small, damage: Callable[[Small], None]
) -> None:
    write_pictures(small.sequence / "image_3", 6)
    damage(small)
    log = read(small)
    assert [camera.name for camera in log.cameras] == ["image_2"]
    assert log.problems[0].startswith("image_3: no usable calibration")


@pytest.mark.parametrize("instead", ["", "Tr: 1 2 3\n", line("Tr", [1.0] * 12)])
def test_without_a_place_of_the_lidar_there_are_no_sweeps(small: Small, instead: str) -> None:
    _calibration("Tr", instead)(small)
    log = read(small)
    assert log.sweeps == ()
    assert "there are no sweeps" in log.problems[0]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("poses/04.txt", None, "sequences 11 to 21 have none"),
        ("poses/04.txt", "", "holds no poses"),
        ("poses/04.txt", "1 2 3 4 5 6 7 8 9 10 11 12\n", "not rigid"),
        ("poses/04.txt", "1 0 0 0 0 1 0 0 0 0 1 5e6\n", "over 1000 km off"),
        ("poses/04.txt", "0 0 0 0 0 0 0 1\n", "8 numbers a line"),
        ("sequences/04/times.txt", None, "cannot be read"),
        ("sequences/04/times.txt", "0.0\n0.1\n", "has 2 times, but there are 4 poses"),
        ("sequences/04/times.txt", "0 1 2 then", "expected a time in seconds"),
        ("sequences/04/times.txt", "0 1 1 2", "increase"),
        ("sequences/04/times.txt", "0 1 2 nan", "increase"),
        ("sequences/04/calib.txt", None, "no camera of it can be read"),
        ("sequences/04/image_2/000000.png", "no picture", "no camera of it can be read"),
    ],
)
def test_what_is_needed_is_told(small: Small, name: str, text: str | None, said: str) -> None:
    path = small.odometry / name
    if text is None:
        path.unlink()
    else:
        path.write_text(text)
    with pytest.raises(InputError, match=said):
        read(small)


def test_pictures_and_sweeps_that_are_missing_are_counted(small: Small) -> None:
    (small.sequence / "image_2" / "000001.png").unlink()
    (small.sequence / "velodyne" / "000003.bin").unlink()
    log = read(small)
    assert (len(log.cameras[0]), len(log.sweeps)) == (3, 3)
    assert log.problems == (
        "image_2: 1 of 4 files are missing, first 1",
        "velodyne: 1 of 4 files are missing, first 3",
    )


@given(
    st.binary(max_size=120),
    st.sampled_from(["poses/04.txt", "sequences/04/times.txt", "sequences/04/calib.txt"]),
)
def test_any_bytes_in_a_file_are_read_or_told(
    tmp_path_factory: pytest.TempPathFactory, data: bytes, name: str
) -> None:
    root = tmp_path_factory.getbasetemp() / "any"
    if not root.exists():
        write_pictures(root / "sequences" / "04" / "image_2", 6)
        (root / "poses").mkdir()
    (root / "poses" / "04.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    (root / "sequences" / "04" / "times.txt").write_text("0\n")
    (root / "sequences" / "04" / "calib.txt").write_text("P2: 50 0 31 0 0 50 12 0 0 0 1 0\n")
    (root / name).write_bytes(data)
    try:
        assert len(read_kitti_odometry(root, "04").cameras) == 1
    except InputError:
        return


def test_the_clip_in_the_data_gives_the_same_drive(data_dir: Path, tmp_path: Path) -> None:
    """Pictures and poses of sequence 04 that are there in another form; camera 2 stands for camera 0."""
    clip = data_dir / "clips" / "kitti_odom04_follow_van"
    told = json.loads((clip / "meta.json").read_text())
    sequence = tmp_path / "sequences" / "04"
    (sequence / "image_2").mkdir(parents=True)
    (tmp_path / "poses").mkdir()
    shutil.copy(clip / "poses.txt", tmp_path / "poses" / "04.txt")
    for step in range(told["n_frames"]):
        os.symlink(clip / "frames" / f"{step:04d}.jpg", sequence / "image_2" / f"{step:06d}.png")
    k = told["intrinsics"]
    matrix = [k["fx"], 0, k["cx"], 0, 0, k["fy"], k["cy"], 0, 0, 0, 1, 0]
    (sequence / "calib.txt").write_text(line("P2", matrix))
    (sequence / "times.txt").write_text("".join(f"{0.1 * step}\n" for step in range(told["n_frames"])))
    log = read_kitti_odometry(tmp_path, "04")
    (camera,) = log.cameras
    assert (len(camera), camera.pinhole.width_px) == (told["n_frames"], told["width"])
    poses = np.loadtxt(clip / "poses.txt").reshape(-1, 3, 4)
    to_first = np.linalg.inv(camera.world_from_camera[0]) @ camera.world_from_camera
    np.testing.assert_allclose(to_first[:, :3], poses, atol=1e-5)
    way = log.world_from_ego[-1, :3, 3]
    assert way[0] == pytest.approx(69, abs=2)
    assert np.abs(way[1:]).max() < 3
    for step in range(0, told["n_frames"], 10):
        seen = np.load(clip / "lidar_depth" / f"{step:04d}.npz")
        pixels = np.stack([seen["u"] + 0.5, seen["v"] + 0.5, seen["depth"]], axis=1).astype(float)
        points = camera.pinhole.at(camera.ego_from_camera).lift(pixels)
        road = points[(points[:, 0] < 20) & (np.abs(points[:, 1]) < 1.5) & (np.abs(points[:, 2]) < 1)]
        assert abs(np.median(road[:, 2])) < 0.25


def test_real_files_where_they_are(data_dir: Path) -> None:
    """Any sequence, if somebody put it there."""
    folder = data_dir / "kitti_odometry"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there")
    assert KITTI_ODOMETRY.logs is not None
    log = KITTI_ODOMETRY.logs.read(folder, KITTI_ODOMETRY.logs.names(folder)[0])
    assert len(log.cameras) > 0
    np.testing.assert_allclose(log.world_from_ego[0], np.eye(4), atol=1e-6)


def test_halved_pictures_are_named(small: Small) -> None:
    halved(small.sequence / "image_2")
    with pytest.raises(InputError, match="principal point, 32, 12, is not that of pictures of 32x12"):
        read(small)
