"""Sequences of PandaSet as logs."""

import gzip
import json
import os
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.datasets.lidar_file import read_points
from dreamdrive.datasets.pandaset import PANDASET, read_pandaset
from dreamdrive.datasets.pandaset.boxes import CATEGORIES, read_boxes
from dreamdrive.datasets.pandaset.log import CAMERAS
from dreamdrive.errors import InputError
from dreamdrive.scene.street.log import BoxTrack, Log
from tests.datasets.pandaset.conftest import (
    COUNT,
    START_S,
    Small,
    cuboid,
    cuboids,
    ego_at,
    ego_from_camera,
    listed,
    write_cuboids,
)
from tests.datasets.pandaset.pickles import write_table


def read(small: Small) -> Log:
    return read_pandaset(small.root, "001")


def box(log: Log, name: str) -> BoxTrack:
    return next(each for each in log.boxes if each.id == name)


def test_a_folder_and_a_sequence_of_it_are_recognised(small: Small) -> None:
    assert PANDASET.recognises(small.root)
    assert PANDASET.recognises(small.sequence)
    assert not PANDASET.recognises(small.root.parent)
    assert PANDASET.logs is not None
    assert PANDASET.logs.names(small.root) == PANDASET.logs.names(small.sequence) == ("001",)
    assert read_pandaset(small.sequence, "001").name == "001"


def test_the_drive_is_that_of_the_files(small: Small) -> None:
    log = read(small)
    assert log.problems == ()
    assert log.start_us == round(START_S * 1e6)
    np.testing.assert_allclose(log.times_s, small.times_s, atol=1e-6)
    np.testing.assert_allclose(log.world_from_ego, [ego_at(t) for t in small.times_s], atol=1e-9)
    assert tuple(camera.name for camera in log.cameras) == CAMERAS
    for number, camera in enumerate(log.cameras):
        times_s = small.times_s + 0.01 * number
        np.testing.assert_allclose(camera.times_s, times_s, atol=1e-6)
        truth = [ego_at(t) @ ego_from_camera(camera.name) for t in times_s]
        np.testing.assert_allclose(camera.world_from_camera, truth, atol=1e-9)
        np.testing.assert_allclose(camera.ego_from_camera, ego_from_camera(camera.name), atol=2e-3)
        assert camera.key.all()
    pinhole = log.camera("front").pinhole
    assert (pinhole.fx_px, pinhole.fy_px, pinhole.cx_px, pinhole.cy_px) == (60.0, 61.0, 32.0, 23.5)
    assert (pinhole.width_px, pinhole.height_px) == (64, 48)


def test_a_roll_of_the_lidar_is_no_roll_of_the_car(small: Small) -> None:
    """Bug: the pose of PandaSet's lidar is rolled by 2 degrees against the road."""
    poses = json.loads((small.sequence / "lidar" / "poses.json").read_text())
    for pose in poses:
        heading = Rotation.from_quat([pose["heading"][k] for k in "wxyz"], scalar_first=True)
        turned = heading * Rotation.from_euler("y", 2, degrees=True)
        pose["heading"] = dict(zip("wxyz", turned.as_quat(scalar_first=True).tolist(), strict=True))
    (small.sequence / "lidar" / "poses.json").write_text(json.dumps(poses))
    truth = np.array([ego_at(t) for t in small.times_s])
    np.testing.assert_allclose(read(small).world_from_ego[:, :3, :3], truth[:, :3, :3], atol=1e-9)


def test_cuboids_are_boxes_that_look_along_their_length(small: Small) -> None:
    log = read(small)
    car = box(log, "main")
    assert (car.category, car.moves.tolist()) == ("vehicle.car", [1] * COUNT)
    assert set(car.attributes) == {("vehicle.moving",)}
    np.testing.assert_allclose(car.size_lwh_m, [[4.5, 1.9, 1.6]] * COUNT)
    np.testing.assert_allclose(car.times_s, log.times_s)
    # Yaw 0 is along y and counts against the clock: -90 degrees is along x.
    np.testing.assert_allclose(car.world_from_box[:, :3, 0], [[1, 0, 0]] * COUNT, atol=1e-12)
    truck, child = box(log, "truck"), box(log, "child")
    assert (truck.category, set(truck.attributes)) == ("vehicle.truck", {("vehicle.parked",)})
    assert (child.category, set(child.attributes)) == ("human.pedestrian.child", {("pedestrian.standing",)})
    assert set(truck.moves) == set(child.moves) == {0}


def test_what_both_lidars_see_is_one_box(small: Small) -> None:
    """The main lidar's box counts; where there is none, that of the front one is on the same track."""
    log = read(small)
    assert {each.id for each in log.boxes} == {"main", "child", "truck"}
    np.testing.assert_allclose(box(log, "main").world_from_box[:, 0, 3], [20, 21.2, 22.2, 23.2])


@pytest.mark.parametrize(("front", "main"), [("-", "front"), ("main", "-"), ("main", "gone")])
def test_one_side_of_siblings_is_enough(tmp_path: Path, front: str, main: str) -> None:
    """In PandaSet some siblings name nothing, or a name that is cut off."""
    rows = [
        cuboid("front", "Car", 1, cuboids__sensor_id=1, cuboids__sibling_id=front),
        cuboid("main", "Car", 2, cuboids__sensor_id=0, cuboids__sibling_id=main),
    ]
    write_cuboids(tmp_path / "00.pkl", rows)
    assert [each.id for each in read_boxes({0: tmp_path / "00.pkl"}, {0: 0.0}, [])] == ["main"]


def test_riders_are_told(tmp_path: Path) -> None:
    row = cuboid("a", "Motorized Scooter", 1, attributes__rider_status="With Rider")
    write_cuboids(tmp_path / "00.pkl", [row])
    (track,) = read_boxes({0: tmp_path / "00.pkl"}, {0: 0.0}, [])
    assert (track.category, track.attributes, track.moves.tolist()) == (
        "vehicle.motorcycle",
        (("cycle.with_rider",),),
        [1],
    )


def test_unknown_labels_are_named(small: Small) -> None:
    rows = [*cuboids(0), cuboid("x", "Hovercraft", 3)]
    write_cuboids(small.sequence / "annotations" / "cuboids" / "00.pkl.gz", rows)
    log = read(small)
    assert any("Hovercraft" in problem for problem in log.problems)
    assert {each.id for each in log.boxes} == {"main", "child", "truck"}


def test_all_labels_have_a_category() -> None:
    assert len(CATEGORIES) == 28


@pytest.mark.parametrize("key", ["position.x", "dimensions.z", "yaw"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -1e12])
def test_cuboids_without_usable_numbers_are_left_out(tmp_path: Path, key: str, value: float) -> None:
    rows = [cuboid("a", "Car", 1.0), cuboid("b", "Car", 1.0) | {key: value}]
    write_cuboids(tmp_path / "00.pkl", rows)
    problems: list[str] = []
    assert [each.id for each in read_boxes({0: tmp_path / "00.pkl"}, {0: 0.0}, problems)] == ["a"]
    assert problems == ["00.pkl: 1 cuboids have no usable numbers and are left out"]


def test_tables_of_a_newer_pandas_and_unpacked_ones_are_read(small: Small) -> None:
    folder = small.sequence / "annotations" / "cuboids"
    for step in range(COUNT):
        (folder / f"{step:02d}.pkl.gz").unlink()
        write_cuboids(folder / f"{step:02d}.pkl", cuboids(step), new=True)
    log = read(small)
    assert (log.problems, len(log.boxes)) == ((), 3)


def test_sweeps_lie_in_the_world(small: Small) -> None:
    log = read(small)
    assert [sweep.time_s for sweep in log.sweeps] == pytest.approx(log.times_s.tolist())
    for sweep in log.sweeps:
        np.testing.assert_array_equal(sweep.world_from_points, np.eye(4))
        assert read_points(sweep.file).shape == (50, 3)


def test_a_clip_of_several_cameras(small: Small) -> None:
    clip = PANDASET.read(small.root, scene="001", cameras="front,front_left", size=(64, 48))
    assert (len(clip), len(clip.rig), clip.known.intrinsics) == (2 * COUNT, 2, True)
    assert PANDASET.read(small.sequence, size=(64, 48)).frames.shape == (COUNT, 48, 64, 3)


def test_there_is_no_such_sequence(small: Small) -> None:
    with pytest.raises(InputError, match="no sequence 999"):
        read_pandaset(small.root, "999")


class Call:
    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, (f"touch {self.mark}",)


def _remove(*parts: str) -> Callable[[Path], None]:
    def remove(folder: Path) -> None:
        path = folder.joinpath(*parts)
        shutil.rmtree(path) if path.is_dir() else path.unlink()

    return remove


def _write(text: str, *parts: str) -> Callable[[Path], None]:
    return lambda folder: folder.joinpath(*parts).write_text(text) and None


def _halve(*parts: str) -> Callable[[Path], None]:
    def halve(folder: Path) -> None:
        path = folder.joinpath(*parts)
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])

    return halve


LEFT = ("camera", "left_camera")
FAR = np.eye(4)
FAR[0, 3] = 9e6


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (_remove(*LEFT, "intrinsics.json"), "left_camera: no usable calibration"),
        (_write('{"fx": 0, "fy": 1, "cx": 1, "cy": 1}', *LEFT, "intrinsics.json"), "left_camera: no usable"),
        (_write('{"fx": "far"}', *LEFT, "intrinsics.json"), "left_camera: no usable calibration"),
        (_remove(*LEFT, "poses.json"), "left_camera is left out"),
        (_halve(*LEFT, "poses.json"), "left_camera is left out"),
        (_write("[]", *LEFT, "poses.json"), "0 poses and 4 times"),
        (_write("[1, 2, 2, 3]", *LEFT, "timestamps.json"), "strictly increasing"),
        (_write("[1, 2, 3]", *LEFT, "timestamps.json"), "4 poses and 3 times"),
        (_write(json.dumps(listed([FAR] * COUNT)), *LEFT, "poses.json"), "over 5000 km off"),
        (_halve(*LEFT, "00.jpg"), "left_camera: no usable calibration"),
    ],
)
def test_a_camera_that_is_broken_is_named_and_the_others_work(
    small: Small, damage: Callable[[Path], None], said: str
) -> None:
    damage(small.sequence)
    log = read(small)
    left = {each.name for each in log.cameras}
    assert any(said in problem for problem in log.problems)
    assert left == set(CAMERAS) - {"left_camera"}
    assert len(log.boxes) == 3


def test_pictures_that_are_missing_are_counted(small: Small) -> None:
    (small.sequence / "camera" / "back_camera" / "02.jpg").unlink()
    log = read(small)
    assert log.problems == ("back_camera: 1 of 4 pictures are missing, the first: 02.jpg",)
    assert len(log.camera("back")) == 3
    for file in (small.sequence / "camera" / "back_camera").glob("*.jpg"):
        file.unlink()
    assert "back_camera" not in {camera.name for camera in read(small).cameras}


@pytest.mark.parametrize(
    ("damage", "said", "boxes"),
    [
        (_remove("annotations"), "there are no boxes", 0),
        (_remove("annotations", "cuboids", "01.pkl.gz"), "1 of 4 files are missing", 3),
        (_halve("annotations", "cuboids", "01.pkl.gz"), "cut short", 3),
        (_write("no pickle", "annotations", "cuboids", "01.pkl.gz"), "damaged", 3),
        (_remove("lidar", "03.pkl.gz"), "1 of 4 files are missing, the first: 03.pkl.gz", 3),
    ],
)
def test_labels_and_sweeps_may_be_broken(
    small: Small, damage: Callable[[Path], None], said: str, boxes: int
) -> None:
    damage(small.sequence)
    log = read(small)
    assert any(said in problem for problem in log.problems)
    assert (len(log.boxes), len(log.cameras)) == (boxes, 6)


def test_labelled_times_are_those_with_cuboids(small: Small) -> None:
    (small.sequence / "annotations" / "cuboids" / "00.pkl.gz").unlink()
    log = read(small)
    np.testing.assert_allclose(log.times_s, [0, 0.1, 0.2], atol=1e-6)
    assert log.camera("front").key.tolist() == [False, True, True, True]
    assert log.sweeps[0].time_s == pytest.approx(-0.1, abs=1e-6)


def test_cuboids_that_would_run_something_are_refused(small: Small) -> None:
    mark = small.root / "ran"
    path = small.sequence / "annotations" / "cuboids" / "01.pkl.gz"
    path.write_bytes(gzip.compress(pickle.dumps(Call(mark))))
    log = read(small)
    assert not mark.exists()
    assert any("nothing of it was run" in problem for problem in log.problems)


def test_a_table_of_something_else_is_told(small: Small) -> None:
    write_table(small.sequence / "annotations" / "cuboids" / "01.pkl.gz", {"class": np.arange(3)})
    assert any("has no columns uuid, label" in problem for problem in read(small).problems)


def test_without_lidar_the_front_camera_tells_where_the_car_is(small: Small) -> None:
    shutil.rmtree(small.sequence / "lidar")
    log = read(small)
    assert "There is no pose of the lidar" in log.notes[0]
    np.testing.assert_allclose(log.world_from_ego, [ego_at(t) for t in small.times_s], atol=1e-9)
    shutil.rmtree(small.sequence / "camera" / "front_camera")
    with pytest.raises(InputError, match="where the car was is not known"):
        read(small)


def test_a_sequence_without_pictures_is_an_error(small: Small) -> None:
    for file in small.sequence.glob("camera/*/*.jpg"):
        file.unlink()
    with pytest.raises(InputError, match="no camera of it can be read"):
        read(small)


def test_poses_that_look_up_are_an_error(small: Small) -> None:
    upright = np.eye(4)
    upright[:3, :3] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    (small.sequence / "lidar" / "poses.json").write_text(json.dumps(listed([upright] * COUNT)))
    with pytest.raises(InputError, match="look up or down"):
        read(small)


@given(
    st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=4, max_size=4),
    st.sampled_from(["Car", "Cones", "Ufo", "", "Pedestrian"]),
    st.sampled_from([-1, 0, 1, 7]),
    st.one_of(st.none(), st.booleans(), st.floats(), st.text(max_size=5)),
)
def test_any_cuboid_is_a_box_or_left_out(
    tmp_path_factory: pytest.TempPathFactory, numbers: list[float], label: str, sensor: int, told: object
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.pkl"
    x, y, z, yaw = numbers
    row = cuboid("a", label, x) | {
        "position.y": y,
        "dimensions.z": z,
        "yaw": yaw,
        "cuboids.sensor_id": sensor,
        "attributes.object_motion": told,
    }
    write_cuboids(path, [row])
    problems: list[str] = []
    tracks = read_boxes({0: path}, {0: 0.0}, problems)
    assert len(tracks) == 1 or problems


def test_the_clip_in_the_data_gives_the_same_drive(data_dir: Path, tmp_path: Path) -> None:
    """Frames of sequence 002 that are there in another form, laid out as PandaSet has them."""
    clip = data_dir / "clips" / "pandaset_002"
    told = json.loads((clip / "cameras.json").read_text())
    sequence = tmp_path / "002"
    for name in ("front_camera", "left_camera"):
        camera, folder = told["cameras"][name], sequence / "camera" / name
        folder.mkdir(parents=True)
        for step in camera["frames"]:
            os.symlink(clip / name / f"{step:02d}.jpg", folder / f"{step:02d}.jpg")
        (fx, _, cx), (_, fy, cy), _ = camera["K"]
        (folder / "intrinsics.json").write_text(json.dumps({"fx": fx, "fy": fy, "cx": cx, "cy": cy}))
        (folder / "poses.json").write_text(json.dumps(listed(list(np.array(camera["camera_to_world"])))))
        (folder / "timestamps.json").write_text(json.dumps(camera["timestamps"]))
    (sequence / "lidar").mkdir()
    poses = listed(list(np.array(told["lidar_to_world_pose"])))
    (sequence / "lidar" / "poses.json").write_text(json.dumps(poses))
    (sequence / "lidar" / "timestamps.json").write_text(json.dumps(told["lidar_timestamps"]))
    frames = json.loads((clip / "cuboids.json").read_text())["frames"]
    for step, rows in enumerate(frames):
        write_cuboids(
            sequence / "annotations" / "cuboids" / f"{step:02d}.pkl.gz", [_row(row) for row in rows]
        )
    log = read_pandaset(tmp_path, "002")
    front, left = log.cameras
    np.testing.assert_allclose(
        front.world_from_camera, told["cameras"]["front_camera"]["camera_to_world"], atol=1e-9
    )
    assert (len(front), len(left)) == (80, len(told["cameras"]["left_camera"]["frames"]))
    np.testing.assert_allclose(front.ego_from_camera[:3, 2], [1, 0, 0], atol=0.01)
    np.testing.assert_allclose(left.ego_from_camera[:3, 2], [0, 1, 0], atol=0.06)
    assert sum(len(track.times_s) for track in log.boxes) == sum(map(len, frames))
    ahead = [_along(track) for track in log.boxes if track.category == "vehicle.car" and _far(track)]
    assert np.median(ahead) > 0.99
    bottoms = [
        _bottom(log, track, row)
        for track in log.boxes
        if track.category.startswith("vehicle")
        for row in range(len(track.times_s))
    ]
    near = [height for height, away in bottoms if away < 25]
    assert len(near) > 300
    assert abs(np.median(near)) < 0.15


def _row(row: dict[str, Any]) -> dict[str, Any]:
    x, y, z = row["position"]
    width, length, height = row["size_wlh"]
    return cuboid(
        row["uuid"],
        row["label"],
        x,
        yaw=row["yaw"],
        stationary=row["stationary"],
        position__y=y,
        position__z=z,
        dimensions__x=width,
        dimensions__y=length,
        dimensions__z=height,
        attributes__object_motion=row.get("motion") or np.nan,
    )


def _far(track: BoxTrack) -> bool:
    return float(np.linalg.norm(np.ptp(track.world_from_box[:, :2, 3], axis=0))) > 5


def _along(track: BoxTrack) -> float:
    """Cosine between where a car looks and where it goes."""
    way = track.world_from_box[-1, :3, 3] - track.world_from_box[0, :3, 3]
    return float(way @ track.world_from_box[0, :3, 0] / np.linalg.norm(way))


def _bottom(log: Log, track: BoxTrack, row: int) -> tuple[float, float]:
    """Height of the lower side of a box above the road of the car, and how far off it is."""
    ego = log.world_from_ego[int(np.abs(log.times_s - track.times_s[row]).argmin())]
    place = ego[:3, :3].T @ (track.world_from_box[row, :3, 3] - ego[:3, 3])
    return float(place[2] - track.size_lwh_m[row, 2] / 2), float(np.linalg.norm(place[:2]))


def test_the_real_files_where_they_are(data_dir: Path) -> None:
    """Sequence 002 of the devkit's first test data, if somebody put it there."""
    folder = data_dir / "pandaset" / "002"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there")
    log = read_pandaset(folder, "002")
    assert (len(log.boxes), sum(len(track.times_s) for track in log.boxes)) == (98, 7531)
    points = read_points(log.sweeps[0].file)
    assert points.shape == (166768, 3)
    np.testing.assert_allclose(points[0], [-75.13113788, -79.33168968, 3.51180427])


def test_halved_pictures_have_the_calibration_of_their_size(small: Small) -> None:
    folder = small.sequence / "camera" / "front_camera"
    for size, cx in (((960, 540), 970.0), ((480, 270), 970.0), ((960, 540), 485.0)):
        scale = 1.0 if cx < 500 else size[0] / 1920
        for file in folder.glob("*.jpg"):
            cv2.imwrite(str(file), np.zeros((size[1], size[0], 3), np.uint8))
        told = {"fx": 1970.0, "fy": 1970.0, "cx": cx, "cy": cx * 0.5}
        (folder / "intrinsics.json").write_text(json.dumps(told))
        log = read(small)
        pinhole = log.camera("front_camera").pinhole
        assert pinhole.fx_px == pytest.approx(1970 * scale)
        assert pinhole.cx_px == pytest.approx((cx + 0.5) * scale)
        assert (pinhole.width_px, pinhole.height_px) == size
        assert any("the calibration is scaled" in each for each in log.problems) == (scale != 1)
