"""Raw drives of KITTI as logs."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.datasets.kitti import KITTI_RAW, read_kitti_raw
from dreamdrive.datasets.kitti.files import numbers_by_name
from dreamdrive.datasets.kitti.raw import poses_of_gps
from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.errors import InputError
from dreamdrive.scene.street.log import Log
from tests.data.cameras.test_fitted import halved
from tests.datasets.kitti.conftest import (
    COUNT,
    DATE,
    DRIVE,
    EGO_FROM_CAMERA_0,
    EGO_FROM_LIDAR,
    SIZE,
    Small,
    camera_0_from,
    line,
    projection,
    tracklet,
    tracklets,
    write_pictures,
)


def read(small: Small) -> Log:
    return read_kitti_raw(small.root / "raw", DRIVE)


def truth() -> np.ndarray:
    turn = Rotation.from_euler("xyz", [0.01, -0.02, np.pi / 4]).as_matrix()
    poses = np.tile(np.eye(4), (COUNT, 1, 1))
    poses[:, :3, :3] = turn
    poses[:, :3, 3] = [[step / np.sqrt(2), step / np.sqrt(2), 0.1 * step] for step in range(COUNT)]
    return poses


def test_all_folders_above_a_drive_are_recognised(small: Small) -> None:
    assert KITTI_RAW.logs is not None
    for path in (small.root / "raw", small.date, small.drive):
        assert KITTI_RAW.recognises(path)
        assert KITTI_RAW.logs.names(path) == (DRIVE,)
        assert read_kitti_raw(path, DRIVE).root == small.root / "raw"
    assert not KITTI_RAW.recognises(small.odometry)
    assert not KITTI_RAW.recognises(small.drive / "oxts")
    with pytest.raises(InputError, match="no drive x"):
        read_kitti_raw(small.drive, "x")


def test_a_drive_that_is_not_rectified_is_none(small: Small) -> None:
    small.drive.rename(small.date / DRIVE.replace("sync", "extract"))
    assert not KITTI_RAW.recognises(small.date)


def test_the_drive_is_that_of_the_files(small: Small) -> None:
    log = read(small)
    assert log.problems == ()
    assert log.start_us == 1_317_042_145_000_000
    np.testing.assert_allclose(log.times_s, 0.1 * np.arange(COUNT), atol=1e-6)
    np.testing.assert_allclose(log.world_from_ego, truth(), atol=1e-4)
    assert [camera.name for camera in log.cameras] == ["image_02", "image_03"]
    for camera in log.cameras:
        mounting = EGO_FROM_CAMERA_0 @ camera_0_from(camera.name[-2:])
        np.testing.assert_allclose(camera.ego_from_camera, mounting, atol=1e-6)
        np.testing.assert_allclose(camera.world_from_camera, log.world_from_ego @ mounting, atol=1e-6)
        np.testing.assert_allclose(camera.times_s, 0.01 + 0.1 * np.arange(COUNT), atol=1e-6)
        pinhole = camera.pinhole
        assert (pinhole.width_px, pinhole.height_px) == SIZE
        assert (pinhole.fx_px, pinhole.cx_px, pinhole.cy_px) == (50.0, 31.5, 12.0)
    assert EGO_FROM_CAMERA_0[2, 3] == pytest.approx(1.65, abs=0.01)


def test_poses_follow_the_projection_of_mercator() -> None:
    """A kilometre to the north and to the east at 49 degrees, at the scale of the first latitude."""
    north = np.rad2deg(1000 / 6_378_137)
    east = north / np.cos(np.deg2rad(49))
    made = poses_of_gps({5: [49, 8, 100, 0, 0, 0], 6: [49 + north, 8 + east, 101, 0, 0, np.pi / 2]})
    np.testing.assert_allclose(made[5], np.eye(4))
    np.testing.assert_allclose(made[6][:3, 3], [1000, 1000, 1], atol=0.1)
    np.testing.assert_allclose(made[6][:3, 0], [0, 1, 0], atol=1e-12)


def test_sweeps_are_in_the_frame_of_the_lidar(small: Small) -> None:
    log = read(small)
    assert len(log.sweeps) == COUNT
    for step, sweep in enumerate(log.sweeps):
        wanted = log.world_from_ego[step] @ EGO_FROM_LIDAR
        np.testing.assert_allclose(sweep.world_from_points, wanted, atol=1e-6)
        assert sweep.time_s == pytest.approx(0.1 * step + 0.005, abs=1e-6)
        np.testing.assert_array_equal(read_points(sweep.file), np.full((3, 3), step))


def test_tracklets_are_boxes_in_the_world(small: Small) -> None:
    log = read(small)
    car, cyclist = log.boxes
    assert (car.category, cyclist.category) == ("vehicle.car", "vehicle.bicycle")
    np.testing.assert_allclose(car.times_s, log.times_s[1:])
    np.testing.assert_allclose(cyclist.times_s, log.times_s[:2])
    assert set(cyclist.attributes) == {("cycle.with_rider",)}
    np.testing.assert_allclose(car.size_lwh_m, [[4.2, 1.8, 1.5]] * 3)
    assert (set(car.visibility), set(car.moves), set(car.lidar_points)) == ({4}, {-1}, {-1})
    lidar_from_box = np.eye(4)
    lidar_from_box[:3, :3] = Rotation.from_euler("z", 0.2).as_matrix()
    lidar_from_box[:3, 3] = [10, 2, -1.7 + 0.75]
    wanted = log.world_from_ego[1:] @ EGO_FROM_LIDAR @ lidar_from_box
    np.testing.assert_allclose(car.world_from_box, wanted, atol=1e-6)


def test_grey_cameras_are_taken_where_there_are_no_others(small: Small) -> None:
    write_pictures(small.drive / "image_00" / "data", 10)
    shutil.copy(small.drive / "image_02" / "timestamps.txt", small.drive / "image_00")
    assert [camera.name for camera in read(small).cameras] == ["image_02", "image_03"]
    for name in ("image_02", "image_03"):
        shutil.rmtree(small.drive / name)
    assert [camera.name for camera in read(small).cameras] == ["image_00"]


def test_a_clip_of_both_cameras(small: Small) -> None:
    clip = KITTI_RAW.read(small.drive, cameras="all", size=SIZE)
    assert (len(clip), len(clip.rig)) == (2 * COUNT, 2)


def _edit(name: str, change: Callable[[str], str]) -> Callable[[Small], None]:
    def edit(small: Small) -> None:
        path = small.date / name
        path.write_text(change(path.read_text()))

    return edit


def _without(start: str) -> Callable[[str], str]:
    return lambda text: "".join(row for row in text.splitlines(True) if not row.startswith(start))


def _set(name: str, values: object) -> Callable[[str], str]:
    return lambda text: _without(name)(text) + line(name, values)


@pytest.mark.parametrize(
    "change",
    [
        _without("P_rect_03"),
        _without("S_rect_03"),
        _set("P_rect_03", np.zeros(12)),
        _set("P_rect_03", projection("03")[:2]),
        _set("P_rect_03", projection("03") * [1, 1, 1, 1e6]),
        _set("S_rect_03", [0, 24]),
        _set("S_rect_03", [1e300, 24]),
    ],
)
def test_a_camera_without_calibration_is_named_and_the_other_works(
    small: Small, change: Callable[[str], str]
) -> None:
    _edit("calib_cam_to_cam.txt", change)(small)
    log = read(small)
    assert [camera.name for camera in log.cameras] == ["image_02"]
    assert log.problems[0].startswith("image_03: no usable calibration")
    assert len(log.boxes) == 2


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("calib_cam_to_cam.txt", _without("R_rect_00")),
        ("calib_velo_to_cam.txt", _without("T")),
        ("calib_imu_to_velo.txt", _without("R")),
        ("calib_imu_to_velo.txt", _set("R", np.ones(9))),
        ("calib_imu_to_velo.txt", _set("T", [1e5, 0, 0])),
        ("calib_imu_to_velo.txt", lambda text: text[: len(text) // 2]),
    ],
)
def test_without_the_places_of_sensors_there_is_no_log(
    small: Small, name: str, change: Callable[[str], str]
) -> None:
    _edit(name, change)(small)
    with pytest.raises(InputError, match=name):
        read(small)
    (small.date / name).unlink()
    with pytest.raises(InputError, match="download the calibration"):
        read(small)


def test_frames_with_broken_poses_are_left_out(small: Small) -> None:
    oxts = small.drive / "oxts" / "data"
    (oxts / "0000000001.txt").write_text("49.0 8.4")
    (oxts / "0000000002.txt").write_text("49.0 8.4 nan 0 0 0")
    log = read(small)
    assert len(log.times_s) == len(log.cameras[0]) == len(log.sweeps) == 2
    assert sum("that frame is left out" in problem for problem in log.problems) == 2
    for file in oxts.iterdir():
        file.unlink()
    with pytest.raises(InputError, match="no frame has both"):
        read(small)


@pytest.mark.parametrize("values", ["100 8.4 0 0 0 0", "49 8.4 0 0 0 up", "49 1e9 0 0 0 0", ""])
def test_a_row_that_is_no_pose_is_told(small: Small, values: str) -> None:
    (small.drive / "oxts" / "data" / "0000000000.txt").write_text(values)
    assert any("0000000000.txt" in problem for problem in read(small).problems)


def test_a_jump_around_the_earth_is_told(small: Small) -> None:
    (small.drive / "oxts" / "data" / "0000000001.txt").write_text("49 80 116 0 0 0")
    with pytest.raises(InputError, match="moves over 1000 km"):
        read(small)


@pytest.mark.parametrize("text", ["", "yesterday\n" * COUNT, "2011-99-99 00:00:00.0\n" * COUNT])
def test_times_that_are_none_are_an_error(small: Small, text: str) -> None:
    (small.drive / "oxts" / "timestamps.txt").write_text(text)
    with pytest.raises(InputError, match="no frame has both"):
        read(small)


def test_times_that_stand_still_are_an_error(small: Small) -> None:
    (small.drive / "oxts" / "timestamps.txt").write_text("2011-09-26 13:02:25.5\n" * COUNT)
    with pytest.raises(InputError, match="do not increase"):
        read(small)


def test_sensors_without_times_take_those_of_the_car(small: Small) -> None:
    (small.drive / "image_02" / "timestamps.txt").unlink()
    log = read(small)
    np.testing.assert_allclose(log.cameras[0].times_s, log.times_s)
    assert log.problems[0].startswith("image_02 has no times of its own")


def test_pictures_and_sweeps_that_are_missing_are_counted(small: Small) -> None:
    (small.drive / "image_03" / "data" / "0000000002.png").unlink()
    (small.drive / "velodyne_points" / "data" / "0000000000.bin").unlink()
    log = read(small)
    assert (len(log.cameras[1]), len(log.sweeps)) == (3, 3)
    assert log.problems == (
        "image_03: 1 of 4 files are missing, first 2",
        "velodyne_points: 1 of 4 files are missing, first 0",
    )


def test_a_drive_without_pictures_is_an_error(small: Small) -> None:
    for file in small.drive.glob("image_*/data/*.png"):
        file.unlink()
    with pytest.raises(InputError, match="no camera of it can be read"):
        read(small)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "damaged or cut off"),
        (tracklets([tracklet("Car", 0, 1)])[:-60], "damaged or cut off"),
        ('<?xml version="1.0" encoding="nothing"?><a/>', "damaged or cut off"),
        (tracklets([], '<!DOCTYPE a [<!ENTITY b "c">]>'), "declares entities"),
        (tracklets([], '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]>'), "declares entities"),
        (tracklets([], '<!DOCTYPE a [<!ENTITY % b "c">]>'), "declares entities"),
    ],
)
def test_tracklets_that_are_broken_are_told(small: Small, text: str, said: str) -> None:
    (small.drive / "tracklet_labels.xml").write_text(text)
    log = read(small)
    assert log.boxes == ()
    assert said in log.problems[0]
    assert "there are no boxes" in log.problems[0]


@pytest.mark.parametrize(
    "broken",
    [
        tracklet("Car", 0, 2, tx="far"),
        tracklet("Car", 0, 2, ty="nan"),
        tracklet("Car", 0, 2, rz="1e9"),
        tracklet("Car", 0, 2).replace("<h>1.5</h>", "<h>-1</h>"),
        tracklet("Car", 0, 2).replace("<first_frame>0</first_frame>", ""),
    ],
)
def test_one_tracklet_that_is_broken_leaves_the_others(small: Small, broken: str) -> None:
    (small.drive / "tracklet_labels.xml").write_text(tracklets([broken, tracklet("Van", 0, 2)]))
    log = read(small)
    assert [track.id for track in log.boxes] == ["tracklet-1"]
    assert "tracklet 0 is left out" in log.problems[0]


def test_tracklets_of_unknown_types_and_times_are_left_out(small: Small) -> None:
    items = [tracklet("Misc", 0, 2), tracklet("Car", COUNT, 2), tracklet("Tram", COUNT - 1, 5, occlusion=2)]
    (small.drive / "tracklet_labels.xml").write_text(tracklets(items))
    log = read(small)
    (tram,) = log.boxes
    assert (tram.category, len(tram.times_s), tram.visibility.tolist()) == ("vehicle.bus.rigid", 1, [1])
    assert "Misc" in log.problems[0]
    (small.drive / "tracklet_labels.xml").unlink()
    assert (read(small).boxes, read(small).problems) == ((), ())


@given(st.text(max_size=80))
def test_any_calibration_is_numbers_by_names(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.getbasetemp() / "calib.txt"
    path.write_text(text, encoding="utf-8", errors="replace")
    assert all(np.isfinite(values).all() for values in numbers_by_name(path).values())


@given(
    st.lists(
        st.tuples(
            st.floats(-85, 85),
            st.floats(-180, 180),
            st.floats(-500, 9000),
            *([st.floats(-np.pi, np.pi)] * 3),
        ),
        min_size=1,
        max_size=5,
    )
)
def test_poses_are_rigid_wherever_the_car_is(rows: list[tuple[float, ...]]) -> None:
    poses = np.array(list(poses_of_gps({k: list(row) for k, row in enumerate(rows)}).values()))
    assert np.isfinite(poses).all()
    np.testing.assert_allclose(
        poses[:, :3, :3] @ poses[:, :3, :3].transpose(0, 2, 1),
        np.tile(np.eye(3), (len(rows), 1, 1)),
        atol=1e-9,
    )
    np.testing.assert_allclose(poses[0, :3, 3], 0, atol=1e-9)


def test_a_folder_of_all_dates_lists_their_drives(small: Small) -> None:
    shutil.copytree(small.date, small.date.with_name("2011_09_28"))
    assert DATE in str(small.drive)
    other = small.date.with_name("2011_09_28")
    (other / DRIVE).rename(other / DRIVE.replace("09_26", "09_28"))
    assert KITTI_RAW.logs is not None
    assert len(KITTI_RAW.logs.names(small.root / "raw")) == 2
    assert KITTI_RAW.logs.names(other) == ("2011_09_28_drive_0001_sync",)


def test_real_files_where_they_are(data_dir: Path) -> None:
    """Any raw drives, if somebody put them there: the road is where the ego frame says."""
    folder = data_dir / "kitti_raw"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there")
    assert KITTI_RAW.logs is not None
    log = KITTI_RAW.logs.read(folder, KITTI_RAW.logs.names(folder)[0])
    sweep = log.sweeps[0]
    ego = log.world_from_ego[int(np.abs(log.times_s - sweep.time_s).argmin())]
    pose = np.linalg.inv(ego) @ sweep.world_from_points
    points = read_points(sweep.file) @ pose[:3, :3].T + pose[:3, 3]
    ahead = points[(points[:, 0] > 5) & (points[:, 0] < 20) & (np.abs(points[:, 1]) < 2)]
    assert abs(np.median(ahead[np.abs(ahead[:, 2]) < 1, 2])) < 0.15


def test_halved_pictures_have_the_calibration_of_their_size(small: Small) -> None:
    before = read(small).cameras[0]
    halved(small.drive)
    after = read(small)
    assert after.cameras[0].pinhole.matrix.tolist() == before.pinhole.resized(32, 12).matrix.tolist()
    assert any("the calibration is scaled" in each for each in after.problems)
