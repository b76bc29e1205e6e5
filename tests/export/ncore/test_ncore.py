"""What NCore's own reader finds in sequences of drawn streets and of scenes."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive import Scene, load_scene
from dreamdrive.errors import InputError
from dreamdrive.export import export, scene_to_ncore, world_to_ncore
from dreamdrive.run import codec
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.street.log import box_corners
from dreamdrive.splat import render_scene
from tests.rigs import drives, true_poses

pytest.importorskip("ncore.data.v4", reason="needs the extra ncore")

from tests.export.ncore_reader import Sequence, corners_of, projected, read, world_from_camera

CAMERAS = {"front": "CAM_FRONT", "front_left": "CAM_FRONT_LEFT"}


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("set") / "street"
    world_to_ncore(drives(), folder)
    return folder


@pytest.fixture(scope="module")
def drawn(street: Path) -> Sequence:
    return read(street)


@pytest.fixture(scope="module")
def scene(finished: Path) -> Scene:
    return load_scene(finished / "scene")


@pytest.fixture(scope="module")
def clip(finished: Path) -> Clip:
    return codec.read(finished / "stages/prior", Clip)


@pytest.fixture(scope="module")
def made(scene: Scene, clip: Clip, tmp_path_factory: pytest.TempPathFactory) -> Sequence:
    folder = tmp_path_factory.mktemp("set") / "made"
    scene_to_ncore(scene, folder, clip=clip)
    return read(folder)


def check_pixels(read: Sequence, name: str, frame: int, camera: Camera, world_from_ours: np.ndarray) -> None:
    """Points that we see in a picture are where NCore's camera sees them."""
    pixels = np.random.default_rng(frame).uniform((0, 0, 2), (*size_of(camera), 60), (200, 3))
    found, which = projected(read, name, frame, carried(world_from_ours, camera.lift(pixels)))
    assert len(which) > 190  # some lie on the rim
    assert np.abs(found - pixels[which, :2]).max() < 0.01


def size_of(camera: Camera) -> tuple[int, int]:
    return camera.width_px, camera.height_px


def carried(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ pose[:3, :3].T + pose[:3, 3]


def test_both_cameras_are_there_at_their_times(drawn: Sequence) -> None:
    assert drawn.sequence_id == "street"
    assert sorted(drawn.camera_ids) == ["CAM_FRONT", "CAM_FRONT_LEFT"]
    times_us = drawn.get_camera_sensor("CAM_FRONT_LEFT").frames_timestamps_us.astype(np.int64)
    assert (times_us[:, 0] == times_us[:, 1]).all()
    assert (times_us[:, 0] - times_us[0, 0]).tolist() == [0, 100_000, 200_000, 300_000, 400_000, 500_000]


@pytest.mark.parametrize("mount", CAMERAS)
def test_pictures_are_the_frames(drawn: Sequence, mount: str) -> None:
    sensor = drawn.get_camera_sensor(CAMERAS[mount])
    for frame in range(6):
        assert sensor.get_frame_data(frame).get_encoded_image_format() == "png"
        np.testing.assert_array_equal(sensor.get_frame_image_array(frame), drives()[mount].frames[frame])


@pytest.mark.parametrize("mount", CAMERAS)
def test_poses_and_pixels_are_true(drawn: Sequence, mount: str) -> None:
    world_from_front = world_from_camera(drawn, "CAM_FRONT")[0]
    found = np.linalg.inv(world_from_front) @ world_from_camera(drawn, CAMERAS[mount])
    np.testing.assert_allclose(found, true_poses(mount), atol=1e-9)
    for frame, own in enumerate(true_poses(mount)):
        camera = drives()[mount].cameras[frame].at(own)
        check_pixels(drawn, CAMERAS[mount], frame, camera, world_from_front)


def test_the_world_is_the_car_on_the_road(drawn: Sequence) -> None:
    sensor = drawn.get_camera_sensor("CAM_FRONT")
    mounted = sensor.T_sensor_rig
    assert mounted[2, 3] == pytest.approx(1.5, abs=0.05)
    assert mounted[0, 3] == pytest.approx(1.7, abs=0.05)
    assert mounted[0, 2] > 0.99
    np.testing.assert_allclose(sensor.get_frames_T_source_target("rig", "world", 0), np.eye(4), atol=1e-9)


def test_boxes_are_true(drawn: Sequence) -> None:
    boxes, world_from_front = drives()["front"].boxes, world_from_camera(drawn, "CAM_FRONT")[0]
    times_us = drawn.get_camera_sensor("CAM_FRONT").get_frames_timestamps_us().tolist()
    found = list(drawn.get_cuboid_track_observations())
    assert len(found) == 6 * len(boxes) > 0
    for each in found:
        box = next(true for true in boxes if true.id == each.track_id)
        corners = box_corners(box.world_from_box[times_us.index(each.timestamp_us)], box.size_m)
        np.testing.assert_allclose(corners_of(each), carried(world_from_front, corners), atol=1e-4)
        assert each.source.name == "GT_SYNTHETIC"


def test_lidar_points_lie_where_depth_says(drawn: Sequence) -> None:
    source = drawn.get_point_clouds_source("LIDAR_TOP")
    assert source.pcs_count == 6
    points = source.get_pc(3)
    world = points.transform("world", points.reference_frame_timestamp_us, drawn.pose_graph).xyz
    pixels, which = projected(drawn, "CAM_FRONT", 3, world)
    column, row = np.floor(pixels).astype(int).T
    camera = drives()["front"].cameras[3].at(world_from_camera(drawn, "CAM_FRONT")[3])
    depth = camera.project(world[which])[:, 2]
    assert len(depth) > 100
    assert np.median(np.abs(drives()["front"].depth_m[3][row, column] - depth) / depth) < 1e-3


def test_the_same_bytes_again(street: Path, tmp_path: Path) -> None:
    world_to_ncore(drives(), tmp_path / "street")
    names = sorted(each.name for each in street.glob("[!.]*"))
    archives = ("", "-CAM_FRONT", "-CAM_FRONT_LEFT", "-LIDAR_TOP")
    assert names == sorted(["sequence.json", *(f"street.ncore4{each}.zarr.itar" for each in archives)])
    assert all((tmp_path / "street" / name).read_bytes() == (street / name).read_bytes() for name in names)


def test_a_sequence_is_replaced_only_where_that_is_asked_for(street: Path) -> None:
    with pytest.raises(InputError, match="exists already"):
        world_to_ncore(drives(), street)
    world_to_ncore(drives(), street, replace=True)
    assert len(list(street.glob("[!.]*"))) == 5


def test_poses_and_pixels_are_those_of_the_scene(scene: Scene, made: Sequence) -> None:
    world_from_scene = world_from_camera(made, "CAM_FRONT")[0]
    assert made.camera_ids == ["CAM_FRONT"]
    for frame, camera in enumerate(scene.cameras):
        check_pixels(made, "CAM_FRONT", frame, camera, world_from_scene)
    up = world_from_scene[:3, :3] @ np.array(scene.provenance.up)
    np.testing.assert_allclose(up, (0, 0, 1), atol=1e-6)
    assert world_from_scene[2, 3] == pytest.approx(scene.provenance.camera_height_m)


def test_pictures_are_the_frames_of_the_clip(clip: Clip, made: Sequence) -> None:
    sensor = made.get_camera_sensor("CAM_FRONT")
    for frame in range(len(clip)):
        np.testing.assert_array_equal(sensor.get_frame_image_array(frame), clip.frames[frame])
    times_us = sensor.get_frames_timestamps_us().astype(np.int64)
    np.testing.assert_allclose((times_us - times_us[0]) / 1e6, clip.times_s - clip.times_s[0], atol=1e-6)


def test_without_the_clip_pictures_are_rendered(scene: Scene, tmp_path: Path) -> None:
    export(scene, "ncore", tmp_path / "made")
    found = read(tmp_path / "made").get_camera_sensor("CAM_FRONT").get_frame_image_array(2)
    drawn = render_scene(scene, scene.cameras[2], float(scene.times_s[2])).colour.numpy()
    assert np.abs(found / 255 - drawn).max() <= 0.5 / 255 + 1e-6


def test_boxes_are_those_of_the_actors(scene: Scene, tmp_path: Path) -> None:
    track = Track(scene.times_s[[0, 4]], np.array([[1.0, 1.2, 9.0], [1.0, 1.2, 13.0]]), np.zeros(2))
    box = ActorBox(np.array([4.4, 1.8, 1.5]), np.array([0.0, 0.0, 1.0]))
    actor = Actor(0, "actor 0", "vehicle", 2, track, box, np.ones(2))
    scene_to_ncore(replace(scene, actors=(actor,)), tmp_path / "made")
    sequence = read(tmp_path / "made")
    found = list(sequence.get_cuboid_track_observations())
    assert [each.class_id for each in found] == ["vehicle.car"] * 5
    assert {each.source.name for each in found} == {"AUTOLABEL"}
    world_from_scene, corners = world_from_camera(sequence, "CAM_FRONT")[0], corners_of(found[2])
    bottom = carried(world_from_scene, np.array([[1.0, 1.2, 11.0]]))[0]
    np.testing.assert_allclose(corners[4:].mean(axis=0), bottom, atol=1e-3)
    ahead = world_from_scene[:3, 2] * (1, 1, 0)
    long = corners[:2].mean(axis=0) - corners[2:4].mean(axis=0)
    np.testing.assert_allclose(long, 4.4 * ahead / np.linalg.norm(ahead), atol=1e-4)


def test_what_shows_no_street_is_masked(finished: Path, scene: Scene, clip: Clip, tmp_path: Path) -> None:
    geometry = codec.read(finished / "stages/geometry", Geometry)
    fixed, valid = np.zeros_like(geometry.fixed_regions), clip.valid.copy()
    fixed[0, 30:], valid[2, 0, :5] = 1, False
    geometry = replace(geometry, fixed_regions=fixed, region_names=("bonnet",))
    scene_to_ncore(scene, tmp_path / "made", clip=replace(clip, valid=valid), geometry=geometry)
    masks = read(tmp_path / "made").get_camera_sensor("CAM_FRONT").get_mask_images()
    expected = np.zeros(clip.size[::-1], bool)
    expected[30:], expected[0, :5] = True, True
    np.testing.assert_array_equal(np.asarray(masks["ego"]) > 0, expected)


def test_the_clip_of_another_scene_is_refused(scene: Scene, clip: Clip, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not those of the scene"):
        scene_to_ncore(scene, tmp_path / "made", clip=replace(clip, times_s=clip.times_s + 1))
    assert list(tmp_path.iterdir()) == []


def test_the_package_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ncore.data.v4", None)
    with pytest.raises(InputError, match=r"pip install -e '\.\[ncore\]'"):
        world_to_ncore(drives(), tmp_path / "street")
    assert list(tmp_path.iterdir()) == []
