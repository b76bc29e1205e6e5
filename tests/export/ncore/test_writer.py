"""What NCore's own reader finds in sequences of logs; the second camera of this one is 0.03 s late."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.errors import InputError
from dreamdrive.export import write_ncore
from dreamdrive.export.nuscenes.writer import write_points
from dreamdrive.scene.street.log import Log
from tests.logs import START_US, ego, log, pose, single

pytest.importorskip("ncore.data.v4", reason="needs the extra ncore")

from tests.export.ncore_reader import Sequence, corners_of, read, world_from_camera

LIFTED = pose(0.9, 0, 1.8, -np.pi / 2)
"""Mounting of the lidar."""
WORLD_FROM_LOG = np.linalg.inv(ego(-0.1))


@pytest.fixture
def drive(tmp_path: Path) -> Log:
    return log(tmp_path / "made")


@pytest.fixture
def sequence(drive: Log, tmp_path: Path) -> Sequence:
    write_ncore(drive, tmp_path / "set")
    return read(tmp_path / "set")


def test_cameras_need_not_be_in_step(drive: Log, sequence: Sequence) -> None:
    for camera in drive.cameras:
        found = world_from_camera(sequence, camera.name)
        np.testing.assert_allclose(found, WORLD_FROM_LOG @ camera.world_from_camera, atol=1e-5)
        sensor = sequence.get_camera_sensor(camera.name)
        np.testing.assert_allclose(sensor.T_sensor_rig, camera.ego_from_camera, atol=1e-9)
        assert sensor.get_frames_timestamps_us()[0] == START_US + round(camera.times_s[0] * 1e6)
    np.testing.assert_allclose(np.array(sequence.generic_meta_data["log_from_world"]), ego(-0.1), atol=1e-9)


def test_a_camera_that_is_not_fixed_to_the_car_keeps_its_poses(drive: Log, tmp_path: Path) -> None:
    """As where pictures of slightly different times count as taken at one."""
    front, back = drive.cameras
    moved = replace(back, times_s=front.times_s)
    write_ncore(replace(drive, cameras=(front, moved)), tmp_path / "set")
    sequence = read(tmp_path / "set")
    for camera in (front, moved):
        found = world_from_camera(sequence, camera.name)
        np.testing.assert_allclose(found, WORLD_FROM_LOG @ camera.world_from_camera, atol=1e-9)


def test_pictures_are_kept_byte_for_byte(drive: Log, tmp_path: Path) -> None:
    jpeg = tmp_path / "0.jpg"
    Image.open(drive.cameras[0].files[0]).save(jpeg)
    front = replace(drive.cameras[0], files=(jpeg, *drive.cameras[0].files[1:]))
    write_ncore(replace(drive, cameras=(front, drive.cameras[1])), tmp_path / "set")
    sensor = read(tmp_path / "set").get_camera_sensor("CAM_FRONT")
    for frame, (file, kind) in enumerate(zip(front.files, ("jpeg", *["png"] * 12), strict=True)):
        picture = sensor.get_frame_data(frame)
        assert bytes(picture.get_encoded_image_data()) == file.read_bytes()
        assert picture.get_encoded_image_format() == kind
        assert picture.get_decoded_image().size == (64, 48)


def test_boxes_are_in_the_world(drive: Log, sequence: Sequence) -> None:
    found = list(sequence.get_cuboid_track_observations())
    assert [each.track_id for each in found] == ["car"] * 3 + ["parked"] * 2 + ["cone"] * 3
    corners = drive.boxes[0].corners(2) @ WORLD_FROM_LOG[:3, :3].T + WORLD_FROM_LOG[:3, 3]
    np.testing.assert_allclose(corners_of(found[2]), corners, atol=1e-4)
    assert found[2].timestamp_us == START_US + 1_000_000
    assert found[2].source.name == "EXTERNAL"


def test_sweeps_are_rays_of_a_lidar(drive: Log, sequence: Sequence) -> None:
    source = sequence.get_point_clouds_source("LIDAR_TOP")
    assert sequence.lidar_ids == ["LIDAR_TOP"]
    assert source.pcs_count == len(drive.sweeps)
    np.testing.assert_allclose(source.get_pc(4).xyz, read_points(drive.sweeps[4].file), atol=1e-4)
    np.testing.assert_allclose(sequence.get_lidar_sensor("LIDAR_TOP").T_sensor_rig, LIFTED, atol=1e-6)


def test_points_in_the_world_are_of_no_lidar(drive: Log, tmp_path: Path) -> None:
    sweeps = []
    for number, sweep in enumerate(drive.sweeps):
        turn, step = sweep.world_from_points[:3, :3], sweep.world_from_points[:3, 3]
        place = tmp_path / f"{number}.pcd.bin"
        write_points(place, read_points(sweep.file) @ turn.T + step)
        sweeps.append(replace(sweep, file=place, world_from_points=np.eye(4)))
    write_ncore(replace(drive, sweeps=tuple(sweeps)), tmp_path / "set")
    sequence = read(tmp_path / "set")
    assert sequence.lidar_ids == []
    points = sequence.get_point_clouds_source("LIDAR_TOP").get_pc(4)
    local = points.transform("rig", points.reference_frame_timestamp_us, sequence.pose_graph)
    expected = read_points(drive.sweeps[4].file) @ LIFTED[:3, :3].T + LIFTED[:3, 3]
    np.testing.assert_allclose(local.xyz, expected, atol=1e-3)


def test_sweeps_outside_of_the_pictures_are_left_out(drive: Log, tmp_path: Path) -> None:
    early = replace(drive.sweeps[0], time_s=-0.5)
    write_ncore(replace(drive, sweeps=(early, *drive.sweeps[1:])), tmp_path / "set")
    source = read(tmp_path / "set").get_point_clouds_source("LIDAR_TOP")
    assert source.pc_timestamps_us[0] == START_US
    assert source.pcs_count == len(drive.sweeps) - 1
    write_ncore(replace(drive, sweeps=(early,)), tmp_path / "none")
    assert read(tmp_path / "none").lidar_ids == read(tmp_path / "none").point_clouds_ids == []


def test_a_picture_of_another_size_is_refused(drive: Log, tmp_path: Path) -> None:
    Image.new("RGB", (64, 40)).save(drive.cameras[1].files[3])
    with pytest.raises(InputError, match="expected an upright picture of 64x48 pixels"):
        write_ncore(drive, tmp_path / "set")
    assert not (tmp_path / "set").exists()


def test_a_single_time_is_no_path(drive: Log, tmp_path: Path) -> None:
    alone = single(drive.cameras[0], 1)
    short = replace(
        drive, cameras=(alone,), times_s=drive.times_s[:1], world_from_ego=drive.world_from_ego[:1]
    )
    with pytest.raises(InputError, match="two times or more"):
        write_ncore(replace(short, boxes=(), sweeps=()), tmp_path / "set")
