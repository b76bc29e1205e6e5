"""Drawn streets in the format of nuScenes keep their truth."""

import tempfile

import cv2
import numpy as np
import pytest

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.datasets.nuscenes import read_nuscenes
from dreamdrive.export import export_world
from streetworld import StreetOptions, draw_street, drive
from tests.rigs import drives


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set") / "street"
    export_world(drives(), "street", folder)
    return folder


@pytest.fixture(scope="module")
def log(written):
    return read_nuscenes(written, "street")


def test_the_folder_for_temporary_files_is_not_asked_for_room(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    export_world(drives(), "street", tmp_path / "set")
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_nothing_is_missing(log):
    assert log.problems == log.notes == ()
    assert [camera.name for camera in log.cameras] == ["CAM_FRONT", "CAM_FRONT_LEFT"]
    np.testing.assert_allclose(log.times_s, [0.0, 0.5])
    assert len(log.sweeps) == 2


def test_pictures_are_the_frames(log):
    read = cv2.imread(str(log.cameras[1].files[3]))[..., ::-1]
    true = drives()["front_left"].frames[3]
    assert np.abs(read.astype(int) - true.astype(int)).mean() < 3


def test_poses_are_true(log):
    made = drives()["front"]
    poses = log.cameras[0].world_from_camera
    relative = np.linalg.inv(poses[0]) @ poses
    np.testing.assert_allclose(relative, made.trajectory.world_from_camera, atol=1e-9)
    left = np.linalg.inv(poses[0]) @ log.cameras[1].world_from_camera[0]
    wanted = made.world_from_map @ np.linalg.inv(drives()["front_left"].world_from_map)
    np.testing.assert_allclose(left, wanted, atol=1e-9)


def test_the_car_stands_on_the_road_and_looks_ahead(log):
    assert log.cameras[0].ego_from_camera[2, 3] == pytest.approx(1.5, abs=0.05)
    assert log.cameras[0].ego_from_camera[0, 3] == pytest.approx(1.7, abs=0.05)
    assert log.cameras[0].ego_from_camera[0, 2] > 0.99
    assert np.abs(log.world_from_ego[:, 2, 3]).max() < 0.1


def test_boxes_hold_the_pixels_of_road_users(log):
    made = drives()["front"]
    camera = log.cameras[0]
    for box in log.boxes:
        true = next(each for each in made.boxes if each.id == box.id)
        ours = np.linalg.inv(camera.world_from_camera[0]) @ box.world_from_box[0]
        np.testing.assert_allclose(ours[:3, 3], true.world_from_box[0][:3, 3], atol=1e-6)
        np.testing.assert_allclose(np.sort(box.size_lwh_m[0]), np.sort(true.size_m))
        assert (box.moves[0] == 1) == true.moving or box.moves[0] == 0


def test_lidar_points_lie_where_depth_says(log):
    made, camera = drives()["front"], log.cameras[0]
    sweep = log.sweeps[0]
    points = read_points(sweep.file) @ sweep.world_from_points[:3, :3].T + sweep.world_from_points[:3, 3]
    view = camera.pinhole.at(camera.world_from_camera[0])
    local = (points - view.world_from_camera[:3, 3]) @ view.world_from_camera[:3, :3]
    u = np.floor(view.fx_px * local[:, 0] / local[:, 2] + view.cx_px).astype(int)
    v = np.floor(view.fy_px * local[:, 1] / local[:, 2] + view.cy_px).astype(int)
    seen = (local[:, 2] > 1) & (u >= 0) & (v >= 0) & (u < 96) & (v < 64)
    assert seen.sum() > 100
    depth = made.depth_m[0][v[seen], u[seen]]
    off = np.abs(depth - local[seen, 2]) / local[seen, 2]
    assert np.median(off) < 1e-3


def test_the_map_lies_under_the_car(log):
    place = tuple(map(float, log.world_from_ego[0, :2, 3]))
    roads = [area.outline.astype(np.float32) for area in log.map.areas["drivable_area"]]
    assert max(cv2.pointPolygonTest(road, place, False) for road in roads) > 0


def test_hills_and_lenses_of_the_second_edition_are_kept(tmp_path):
    layout = draw_street(5, StreetOptions(seconds=0.2, edition=2))
    made = {"front": drive(layout, 2, 10.0, (64, 48), antialiased=False)}
    export_world(made, "hills", tmp_path / "set")
    read = read_nuscenes(tmp_path / "set", "hills")
    assert read.problems == ()
    relative = np.linalg.inv(read.cameras[0].world_from_camera[0]) @ read.cameras[0].world_from_camera
    np.testing.assert_allclose(relative, made["front"].trajectory.world_from_camera, atol=1e-9)
    height = read.cameras[0].ego_from_camera[2, 3]
    assert height == pytest.approx(layout.ego.camera_height_m, rel=0.1)
