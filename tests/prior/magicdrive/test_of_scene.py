"""Scenes of data sets: what the networks are told of their own cameras, boxes and maps."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.datasets.log_layout import layout_of_log
from dreamdrive.datasets.nuscenes import read_nuscenes
from dreamdrive.errors import InputError
from dreamdrive.export.nuscenes.writer import write_nuscenes
from dreamdrive.prior import choose_prior
from dreamdrive.prior.magicdrive.cameras import NUSCENES
from dreamdrive.prior.magicdrive.condition import CHANNELS, CLASSES, StreetCondition, see
from dreamdrive.prior.magicdrive.of_scene import class_of, clockwise, mounted_lidar, of_street
from dreamdrive.prior.street import StreetSource
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.street.log import LidarSweep, Log, LogMap
from tests.logs import TIMES_S, camera, ego, log, pose, track
from tests.prior.magicdrive.tiny import SIZE, Written, write_folder

YAWS = {
    "CAM_FRONT": 0.0,
    "CAM_FRONT_LEFT": 1.0,
    "CAM_FRONT_RIGHT": -1.0,
    "CAM_BACK_LEFT": 1.9,
    "CAM_BACK": 3.1,
    "CAM_BACK_RIGHT": -1.9,
}
"""In the order in which data sets list them."""
WORDS = torch.zeros(1, 1, 1)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Log:
    """A drive of six cameras whose boxes the lidar hit."""
    folder = tmp_path_factory.mktemp("scene")
    cameras = tuple(camera(folder / "six", name, yaw) for name, yaw in YAWS.items())
    made = log(folder / "made")
    boxes = tuple(replace(box, lidar_points=box.lidar_points + 1) for box in made.boxes)
    return replace(made, cameras=cameras, boxes=boxes)


def seen_of(scene: Log) -> StreetCondition:
    return of_street(StreetSource(layout_of_log(scene), "the scene", scene, scene.cameras))


def lidar_from_world(scene: Log, time_s: float) -> np.ndarray:
    seen = seen_of(scene)
    return np.linalg.inv(seen.world_from_car(np.array([time_s]))[0] @ seen.ring.car_from_lidar)


def test_the_ring_runs_clockwise_from_the_first(scene: Log) -> None:
    assert seen_of(scene).ring.names == tuple(each.name for each in NUSCENES)
    backwards = (scene.cameras[0], *scene.cameras[:0:-1])
    assert clockwise(backwards) == clockwise(scene.cameras)


def test_intrinsics_are_told_for_a_picture_of_1600_columns(scene: Log) -> None:
    """The first pixel has its centre at 0, and pictures of 64x48 become 1600x1200 without 300 rows on top."""
    ring = seen_of(scene).ring
    np.testing.assert_allclose(ring.told[0], [[1250, 0, 812], [0, 1275, 287], [0, 0, 1]])
    for pinhole in ring.rig((400, 224)):
        assert (pinhole.fx_px, pinhole.cx_px) == pytest.approx((50 * 400 / 64, 32.5 * 400 / 64))
        assert pinhole.height_px - pinhole.cy_px == pytest.approx((48 - 23.5) * 400 / 64)


def test_what_is_told_leads_to_the_same_pixels_as_the_log(scene: Log) -> None:
    """Corners by camera to LiDAR and intrinsics, against poses and pinholes of the pictures."""
    told = see(seen_of(scene), TIMES_S[1:2], 20, WORDS)
    matrices = told.cameras[0].double().numpy()
    corners, _ = seen_of(scene).boxes(lidar_from_world(scene, 0.5), 0.5)
    row = scene.cameras[0].times_s.tolist().index(0.5)
    for name, matrix in zip(seen_of(scene).ring.names, matrices, strict=True):
        own = scene.camera(name)
        local = np.linalg.inv(np.vstack([matrix[:, 3:], [0, 0, 0, 1]]))
        mine = corners[0] @ local[:3, :3].T + local[:3, 3]
        truth = scene.boxes[0].corners(1)
        real = np.linalg.inv(own.world_from_camera[row])
        true = truth @ real[:3, :3].T + real[:3, 3]
        apart = np.linalg.norm(mine[:, None] - true[None], axis=-1)
        assert apart.min(axis=0).max() < 0.03  # half precision of places within 20 m
        assert own.pinhole.matrix[0, 0] / own.pinhole.width_px == pytest.approx(matrix[0, 0] / 1600)


def test_boxes_are_interpolated_between_their_labels(scene: Log) -> None:
    now = lidar_from_world(scene, 0.25)
    corners, classes = seen_of(scene).boxes(now, 0.25)
    assert [CLASSES[kind] for kind in classes] == ["car", "truck", "traffic_cone"]
    centre = now @ [215 + 6 * 0.25, 303, 0.9, 1]
    np.testing.assert_allclose(corners[0].mean(axis=0), centre[:3], atol=1e-6)
    assert np.ptp(corners[0, :, 2]) == pytest.approx(1.6)
    ahead = corners[0, 0] - corners[0, 3]
    np.testing.assert_allclose(ahead / 4.5, now[:3, :3] @ [np.cos(0.3), np.sin(0.3), 0], atol=1e-6)


def test_what_is_not_labelled_or_not_hit_is_not_told(scene: Log) -> None:
    """The truck has no label at the end; of the other boxes the lidar hits nothing at first."""
    ends = [CLASSES[kind] for kind in seen_of(scene).boxes(lidar_from_world(scene, 1.0), 1.0)[1]]
    assert ends == ["car", "traffic_cone"]
    missed = replace(scene, boxes=(track("car", "vehicle.car", 6.0), track("cat", "animal", 0.0)))
    assert len(seen_of(missed).boxes(lidar_from_world(missed, 0.0), 0.0)[1]) == 0
    assert len(seen_of(missed).boxes(lidar_from_world(missed, 0.5), 0.5)[1]) == 1


def test_categories_are_merged_as_in_the_detection_task() -> None:
    classes = {"vehicle.bus.bendy": "bus", "human.pedestrian.child": "pedestrian", "vehicle.carriage": None}
    classes |= {"human.pedestrian.stroller": None, "vehicle.emergency.police": None}
    assert {name: class_of(name) for name in classes} == classes


def test_layers_are_drawn_around_the_lidar(scene: Log) -> None:
    now = lidar_from_world(scene, 0.0)
    layers = dict(zip(CHANNELS, seen_of(scene).raster(now, 200), strict=True))

    def at(x: float, y: float) -> set[str]:
        row, column = (int((value + 50) * 2) for value in (now @ [x, y, 0, 1])[:2])
        return {name for name, cells in layers.items() if cells[row, column]}

    assert at(210, 302) == {"drivable_area"}
    assert at(232, 302) == set()  # the hole
    assert at(220, 325) == {"walkway"}
    assert at(220, 305) == {"drivable_area", "lane_divider"}
    assert at(215, 290) == set()


def test_the_lidar_is_where_the_sweeps_are_told_from(scene: Log) -> None:
    lifted = pose(0.9, 0, 1.8, -np.pi / 2)
    found = mounted_lidar(scene)
    assert found is not None
    np.testing.assert_allclose(found, lifted, atol=1e-6)
    turn = pose(0, 0, 0, np.pi / 2)  # x ahead, as KITTI's
    turned = [replace(each, world_from_points=each.world_from_points @ turn) for each in scene.sweeps]
    again = mounted_lidar(replace(scene, sweeps=tuple(turned)))
    assert again is not None
    np.testing.assert_allclose(again, lifted, atol=1e-6)


def test_without_a_lidar_that_of_nuscenes_stands_for_it_and_that_is_said(scene: Log) -> None:
    in_the_world = tuple(LidarSweep(each.file, each.time_s, np.eye(4)) for each in scene.sweeps)
    for sweeps in ((), in_the_world):
        other = replace(scene, sweeps=sweeps)
        assert mounted_lidar(other) is None
        seen = of_street(StreetSource(layout_of_log(other), "the scene", other, other.cameras))
        front = seen.ring.lidar_from_camera[0]
        np.testing.assert_allclose(front[:3, 3], [0, 0.76, -0.33], atol=1e-9)
        assert any("tells no place of a lidar on the car" in note for note in seen.notes)


def test_the_car_is_where_the_front_camera_was(scene: Log) -> None:
    times_s = np.array([0.0, 0.62, 1.0])
    found = seen_of(scene).world_from_car(times_s)
    np.testing.assert_allclose(found, np.stack([ego(t) for t in times_s]), atol=2e-3)
    with pytest.raises(InputError, match=r"path of CAM_FRONT is known from -0\.10 to 1\.10 s"):
        seen_of(scene).world_from_car(np.array([1.5]))
    beyond = seen_of(scene).world_from_car(np.array([1.2]))[0]
    np.testing.assert_allclose(beyond[:2, 3], ego(1.2)[:2, 3], atol=0.03)


def test_other_rigs_and_scenes_without_a_map_are_refused(scene: Log) -> None:
    street = StreetSource(layout_of_log(scene), "the scene", scene, scene.cameras[:5])
    with pytest.raises(InputError, match=r"a ring of 6 cameras, and the scene gives 5: CAM_FRONT, .*choose"):
        of_street(street)
    bare = replace(scene, map=LogMap())
    with pytest.raises(InputError, match="the scene has no map with a drivable_area"):
        of_street(StreetSource(street.layout, "the scene", bare, scene.cameras))


@pytest.fixture(scope="module")
def control(scene: Log, written: Written, tmp_path_factory: pytest.TempPathFactory) -> Control:
    """The scene as a data set, all of whose pictures are rubbish, weights and the smallest run."""
    folder = tmp_path_factory.mktemp("data") / "set"
    write_nuscenes([scene], folder, read_points)
    for each in read_nuscenes(folder, scene.name).cameras:
        for file in each.files:
            file.write_bytes(b"no picture")
    return Control(folder, weights=written.path, frames="0:3:2", steps=1, fps=2.0)


@pytest.fixture(scope="module")
def clip(control: Control) -> Clip:
    return choose_prior("magicdrive")(control)


def test_a_scene_becomes_six_pictures_of_each_time(scene: Log, clip: Clip) -> None:
    """Its pictures are never opened."""
    assert clip.frames.shape == (12, *SIZE[::-1], 3)
    assert clip.provenance["cameras"] == [each.name for each in NUSCENES]
    front = clip.rig[0]
    assert front.fx_px == pytest.approx(50 * SIZE[0] / 64)
    back = scene.camera("back").ego_from_camera
    mounted = np.linalg.inv(scene.cameras[0].ego_from_camera) @ back
    np.testing.assert_allclose(clip.rig[3].world_from_camera, mounted, atol=1e-6)
    poses = clip.known.world_from_camera
    assert poses is not None
    at = [ego(t) @ scene.cameras[0].ego_from_camera for t in (0.0, 1.0)]
    np.testing.assert_allclose(poses[6], np.linalg.inv(at[0]) @ at[1], atol=1e-3)
    notes = " ".join(clip.provenance["notes"])
    assert "generated from the scene scene-0001 of set by magicdrive" in notes
    assert "has no ped_crossing, stop_line, carpark_area, road_divider, road_block: those channels" in notes
    assert "told that it is boston-seaport: they never heard of nowhere-scene-0001" in notes
    assert clip.provenance["prompt"] == "A driving scene image at boston-seaport. A street that is made up."


def test_the_clip_lies_where_the_front_camera_was(control: Control, scene: Log, clip: Clip) -> None:
    """With the heights and the tilt of the log: nothing is made level."""
    later = choose_prior("magicdrive")(replace(control, frames="1:2"))
    for made, time_s in ((clip, 0.0), (later, 0.5)):
        assert made.log is not None
        assert (made.log.name, made.log.start_s, made.log.level_z_m) == (scene.name, time_s, None)
        front = ego(time_s) @ scene.cameras[0].ego_from_camera
        np.testing.assert_allclose(np.array(made.log.log_from_world), front, atol=2e-3)


def test_the_temporal_variant_needs_a_scene_as_long_as_its_clip(control: Control, tmp_path: Path) -> None:
    weights = write_folder(tmp_path / "temporal", temporal=True).path
    with pytest.raises(InputError, match="is labelled for 13 time steps at 12 Hz, and these weights"):
        choose_prior("magicdrive-t")(replace(control, weights=weights, fps=None))
