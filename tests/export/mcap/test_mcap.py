"""What is read back of logs, drawn streets and scenes; the second camera of the log is 0.03 s late."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.errors import InputError
from dreamdrive.export import export, scene_to_mcap, world_to_mcap, write_mcap
from dreamdrive.export.log import START_US as FIRST_US
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.log import Log, box_corners
from dreamdrive.splat import render_scene
from dreamdrive.stored import save_scene
from tests.conftest import ROOT
from tests.logs import START_US, ego, log, single
from tests.rigs import drives, true_poses
from tests.streets import street_clip
from tests.tasks.environment.scenes import AHEAD, ONCOMING, scene as driven_scene

pytest.importorskip("foxglove", reason="needs the extra mcap")
pytest.importorskip("mcap_protobuf", reason="pip install mcap-protobuf-support")

from tests.export.mcap_reader import Message, Recording, picture_of, placed, points_of, pose_of, read

GUIDE = ROOT / "docs" / "guides" / "closed_loop.md"
BOXES = "/markers/annotations"


def image(camera: str) -> str:
    return f"/{camera}/image_rect_compressed"


def after(time_s: float, start_us: int = FIRST_US) -> int:
    return start_us * 1000 + round(time_s * 1e9)


@pytest.fixture
def drive(tmp_path: Path) -> Log:
    return log(tmp_path / "made")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "drive.mcap"


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    file = tmp_path_factory.mktemp("street") / "street.mcap"
    world_to_mcap(drives(), file)
    return read(file)


def test_a_log_keeps_its_pictures_byte_for_byte(drive: Log, file: Path) -> None:
    write_mcap(drive, file)
    found = read(file)
    for camera in drive.cameras:
        times_ns = [after(time_s, START_US) for time_s in camera.times_s]
        assert found.times(image(camera.name)) == found.times(f"/{camera.name}/camera_info") == times_ns
        for time_ns, picture in zip(times_ns, camera.files, strict=True):
            told = found.at(image(camera.name), time_ns)
            assert (told.data, told.format) == (picture.read_bytes(), "png")
            assert told.timestamp.ToNanoseconds() == time_ns
    assert found.facts == {"name": drive.name, "about": drive.about, "location": drive.location}


def test_cameras_of_a_log_need_not_be_in_step(drive: Log, file: Path) -> None:
    write_mcap(drive, file)
    found = read(file)
    for camera in drive.cameras:
        for time_s, pose in zip(camera.times_s, camera.world_from_camera, strict=True):
            np.testing.assert_allclose(placed(found, after(time_s, START_US), camera.name), pose, atol=1e-9)
    for time_s in drive.times_s:
        np.testing.assert_allclose(
            placed(found, after(time_s, START_US), "base_link"), ego(time_s), atol=1e-9
        )
    known = [{each.child_frame_id for each in message.transforms} for _, message in found.messages["/tf"]]
    assert known == [{"base_link", "CAM_FRONT", "CAM_BACK_LEFT"}] * 26


def test_a_camera_that_is_not_fixed_to_the_car_keeps_its_poses(drive: Log, file: Path) -> None:
    front, back = drive.cameras
    moved = replace(back, times_s=front.times_s)
    write_mcap(replace(drive, cameras=(front, moved)), file)
    found = read(file)
    for camera in (front, moved):
        for time_s, pose in zip(camera.times_s, camera.world_from_camera, strict=True):
            np.testing.assert_allclose(placed(found, after(time_s, START_US), camera.name), pose, atol=1e-9)


def test_boxes_and_sweeps_of_a_log(drive: Log, file: Path) -> None:
    write_mcap(drive, file)
    found = read(file)
    names = {0.0: ["car", "parked", "cone"], 0.5: ["car", "parked", "cone"], 1.0: ["car", "cone"]}
    assert found.times(BOXES) == [after(time_s, START_US) for time_s in names]
    for time_s, expected in names.items():
        entities = found.at(BOXES, after(time_s, START_US)).entities
        assert [each.id for each in entities] == expected
    last = found.at(BOXES, after(1.0, START_US)).entities[0]
    np.testing.assert_allclose(corners_of(last), drive.boxes[0].corners(2), atol=1e-9)
    assert last.metadata[0].value == "vehicle.car"
    assert len(found.messages["/LIDAR_TOP"]) == len(drive.sweeps)
    sweep = drive.sweeps[4]
    points = read_points(sweep.file) @ sweep.world_from_points[:3, :3].T + sweep.world_from_points[:3, 3]
    np.testing.assert_allclose(
        points_of(found.at("/LIDAR_TOP", after(sweep.time_s, START_US))), points, atol=1e-5
    )


def corners_of(entity: Message) -> np.ndarray:
    (cube,) = entity.cubes
    return box_corners(pose_of(cube.pose), np.array([cube.size.x, cube.size.y, cube.size.z]))


def test_pictures_that_viewers_do_not_know_become_png(drive: Log, file: Path) -> None:
    front = drive.cameras[0]
    first = front.files[0].with_suffix(".bmp")
    pixels = cv2.imread(str(front.files[0]))
    cv2.imwrite(str(first), pixels)
    write_mcap(
        replace(drive, cameras=(replace(front, files=(first, *front.files[1:])), drive.cameras[1])), file
    )
    told = read(file).messages[image("CAM_FRONT")][0][1]
    assert told.format == "png"
    np.testing.assert_array_equal(picture_of(told), pixels[..., ::-1])


def test_a_picture_of_another_size_is_refused(drive: Log, file: Path) -> None:
    cv2.imwrite(str(drive.cameras[1].files[3]), np.zeros((40, 64, 3), np.uint8))
    with pytest.raises(InputError, match="expected an upright picture of 64x48 pixels"):
        write_mcap(drive, file)
    assert not file.exists()


def test_a_log_of_one_time_is_written(drive: Log, file: Path) -> None:
    alone = single(drive.cameras[0], 1)
    write_mcap(
        replace(
            drive,
            cameras=(alone,),
            times_s=drive.times_s[:1],
            world_from_ego=drive.world_from_ego[:1],
            boxes=(),
            sweeps=(),
        ),
        file,
    )
    found = read(file)
    assert found.times(image("CAM_FRONT")) == found.times("/tf") == [after(0.0, START_US)]
    assert [len(message.entities) for _, message in found.messages[BOXES]] == [0]


@pytest.mark.parametrize("mount", ["front", "front_left"])
def test_frames_and_poses_of_a_street_are_true(street: Recording, mount: str) -> None:
    made, name = drives()[mount], f"CAM_{mount.upper()}"  # type: ignore[index]
    world_from_front = placed(street, after(0.0), "CAM_FRONT")
    for frame, (time_s, pose) in enumerate(zip(made.times_s, true_poses(mount), strict=True)):  # type: ignore[arg-type]
        time_ns = after(time_s)
        np.testing.assert_array_equal(picture_of(street.at(image(name), time_ns)), made.frames[frame])
        np.testing.assert_allclose(placed(street, time_ns, name), world_from_front @ pose, atol=1e-9)
        told = street.at(f"/{name}/camera_info", time_ns)
        assert list(told.K) == made.cameras[frame].matrix.ravel().tolist()
        assert (told.width, told.height) == (96, 64)


def test_a_street_stands_on_the_ground(street: Recording) -> None:
    car = placed(street, after(0.0), "base_link")
    np.testing.assert_allclose(car[:3, 2], (0, 0, 1), atol=0.05)
    mounted = np.linalg.inv(car) @ placed(street, after(0.0), "CAM_FRONT")
    assert mounted[0, 3] == pytest.approx(1.7, abs=0.05)
    assert mounted[2, 3] == pytest.approx(1.5, abs=0.05)
    assert mounted[0, 2] > 0.99  # it looks ahead


def test_boxes_of_a_street_are_true(street: Recording) -> None:
    boxes, world_from_front = drives()["front"].boxes, placed(street, after(0.0), "CAM_FRONT")
    turn, step = world_from_front[:3, :3], world_from_front[:3, 3]
    assert boxes
    for frame, time_s in enumerate(drives()["front"].times_s):
        entities = street.at(BOXES, after(time_s)).entities
        assert sorted(each.id for each in entities) == sorted(box.id for box in boxes)
        for entity in entities:
            box = next(each for each in boxes if each.id == entity.id)
            corners = box_corners(box.world_from_box[frame], box.size_m) @ turn.T + step
            np.testing.assert_allclose(corners_of(entity), corners, atol=1e-6)


def test_points_of_a_street_lie_where_depth_says(street: Recording) -> None:
    made = drives()["front"]
    points = points_of(street.at("/LIDAR_TOP", after(made.times_s[3])))
    camera = made.cameras[3].at(placed(street, after(made.times_s[3]), "CAM_FRONT"))
    seen = camera.project(points)
    seen = seen[(seen[:, 2] > 1) & (seen[:, :2] > 0).all(axis=1) & (seen[:, :2] < (96, 64)).all(axis=1)]
    column, row = np.floor(seen[:, :2]).astype(int).T
    depth_m = made.depth_m[3][row, column]
    assert len(seen) > 100
    assert np.median(np.abs(depth_m - seen[:, 2]) / seen[:, 2]) < 1e-3


@pytest.fixture(scope="module")
def scene() -> Scene:
    return driven_scene(AHEAD, ONCOMING, seconds=0.4, seen_s=(0.1, 0.3))


def test_a_scene_is_rendered(scene: Scene, file: Path) -> None:
    export(scene, "mcap", file)
    found = read(file)
    world_from_scene = placed(found, after(0.0), "CAM_FRONT") @ np.linalg.inv(
        scene.cameras[0].world_from_camera
    )
    np.testing.assert_allclose(world_from_scene[:3, :3] @ np.array(scene.provenance.up), (0, 0, 1), atol=1e-6)
    for camera, time_s in zip(scene.cameras, scene.times_s, strict=True):
        shown = picture_of(found.at(image("CAM_FRONT"), after(time_s)))
        drawn = render_scene(scene, camera, float(time_s)).colour.numpy()
        assert np.abs(shown / 255 - drawn).max() <= 0.5 / 255 + 1e-6
        pose = world_from_scene @ camera.world_from_camera
        np.testing.assert_allclose(placed(found, after(time_s), "CAM_FRONT"), pose, atol=1e-9)
    assert len(points_of(found.at("/LIDAR_TOP", after(0.2)))) > 100


def test_actors_of_a_scene_come_and_go(scene: Scene, file: Path) -> None:
    scene_to_mcap(scene, file)
    found = read(file)
    there = {time_s: found.at(BOXES, after(time_s)).entities for time_s in scene.times_s.tolist()}
    assert [len(each) for each in there.values()] == [0, 2, 2, 2, 0]
    assert [each.id for each in there[0.2]] == ["actor 0", "actor 1"]
    ahead_m, left_m, speed_m_s, _ = ONCOMING
    car = np.linalg.inv(placed(found, after(0.0), "base_link"))
    middle = car @ pose_of(there[0.2][1].cubes[0].pose)[:, 3]
    np.testing.assert_allclose(middle[:3], (1.7 + ahead_m + 0.2 * speed_m_s, left_m, 0.75), atol=1e-3)
    assert car[:3, :3] @ pose_of(there[0.2][1].cubes[0].pose)[:3, 0] == pytest.approx((-1, 0, 0), abs=1e-6)


def test_frames_of_the_clip_are_written(scene: Scene, file: Path) -> None:
    clip = street_clip(drives()["front"])
    clip = replace(
        clip,
        frames=np.random.default_rng(0).integers(0, 256, (5, 40, 64, 3), dtype=np.uint8),
        times_s=scene.times_s,
        camera=clip.camera[:5],
        valid=np.ones((5, 40, 64), bool),
        held_out=clip.held_out[:5],
        source_index=clip.source_index[:5],
        rig=(scene.cameras[0].at(np.eye(4)),),
        features={},
    )
    scene_to_mcap(scene, file, clip=clip)
    for time_s, frame in zip(scene.times_s, clip.frames, strict=True):
        np.testing.assert_array_equal(picture_of(read(file).at(image("CAM_FRONT"), after(time_s))), frame)
    late = replace(clip, times_s=clip.times_s + 1)
    with pytest.raises(InputError, match="not those of the scene"):
        scene_to_mcap(scene, file, clip=late, replace=True)


def test_a_file_is_replaced_only_where_that_is_asked_for(scene: Scene, file: Path) -> None:
    file.write_bytes(b"older")
    with pytest.raises(InputError, match="exists already"):
        scene_to_mcap(scene, file)
    with pytest.raises(InputError, match="exists already"):
        world_to_mcap(drives(), file)
    assert file.read_bytes() == b"older"
    scene_to_mcap(scene, file, replace=True)
    assert len(read(file).times("/tf")) == 5


def test_the_package_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "foxglove.channels", None)
    with pytest.raises(InputError, match=r"pip install -e '\.\[mcap\]'"):
        world_to_mcap(drives(), tmp_path / "street.mcap")
    assert list(tmp_path.iterdir()) == []


def test_the_program_of_the_guide_records_an_episode(tmp_path: Path) -> None:
    pytest.importorskip("gymnasium", reason="needs the extra environment")
    blocks = [each.split("```")[0] for each in GUIDE.read_text().split("```python\n")[1:]]
    (program,) = [each for each in blocks if "DriveRecording" in each]
    save_scene(driven_scene(AHEAD, ONCOMING, seconds=1.0), tmp_path / "out")
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    subprocess.run([sys.executable, "-c", program], cwd=tmp_path, env=environment, check=True)
    found = read(tmp_path / "episode.mcap")
    times_ns = found.times("/tf")
    assert len(times_ns) >= 3
    assert (np.diff(times_ns) == 100_000_000).all()
    for topic in (image("front"), "/front/camera_info", BOXES, "/numbers/reward"):
        assert found.times(topic) == times_ns
    assert picture_of(found.messages[image("front")][0][1]).shape == (192, 320, 3)
    first = found.messages[BOXES][0][1].entities
    assert [each.id for each in first] == ["user 0", "user 1"]
    near = np.linalg.inv(placed(found, times_ns[0], "base_link")) @ pose_of(first[0].cubes[0].pose)
    assert 10 < near[0, 3] < 20  # the car ahead
    assert abs(near[1, 3]) < 1.5
