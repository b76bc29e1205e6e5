"""Recorded pictures as records: what their lidar and their geometry say of each pixel."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive_train.street_network.data.recorded import clip_records, level_line, pandaset_records
from dreamdrive_train.street_network.data.records import DEPTH_STEPS, FAR, UNKNOWN, Record
from tests.streets import bare_street, street_clip, true_geometry

CLASSES = json.loads(
    """{"1": "Smoke", "5": "Vegetation", "6": "Ground", "7": "Road", "8": "Lane Line Marking",
    "9": "Stop Line Marking", "10": "Other Road Marking", "11": "Sidewalk", "12": "Driveway", "13": "Car",
    "14": "Pickup Truck", "15": "Medium-sized Truck", "16": "Semi-truck", "17": "Towed Object",
    "18": "Motorcycle", "19": "Other Vehicle - Construction Vehicle", "20": "Other Vehicle - Uncommon",
    "22": "Emergency Vehicle", "23": "Bus", "24": "Personal Mobility Device", "25": "Motorized Scooter",
    "26": "Bicycle", "27": "Train", "28": "Trolley", "29": "Tram / Subway", "30": "Pedestrian",
    "31": "Pedestrian with Object", "35": "Road Barriers", "36": "Signs", "38": "Construction Signs",
    "39": "Temporary Construction Barriers", "41": "Building", "42": "Other Static Object"}"""
)
ROAD, CAR, BUILDING, OTHER = 7, 13, 41, 42
HEIGHT_M, PITCH, ROLL = 2.0, 0.05, 0.1


def pose(pitch: float = 0.0, roll: float = 0.0, height_m: float = 0.0) -> np.ndarray:
    """A camera in a world with z up that looks along its x, up by the pitch, then turned clockwise."""
    (c, s), (cr, sr) = (np.cos(pitch), np.sin(pitch)), (np.cos(roll), np.sin(roll))
    ahead, down, right = np.array([c, 0, s]), np.array([s, 0, -c]), np.array([0, -1, 0])
    made = np.eye(4)
    made[:3, :3] = np.column_stack([cr * right + sr * down, cr * down - sr * right, ahead])
    made[:3, 3] = 5, 6, height_m
    return made


@pytest.fixture
def recording(tmp_path: Path) -> tuple[Path, Path]:
    """Two sweeps of a front camera of 1280 pixels, and the second of a tilted one of 640 to the left."""
    folder, front = tmp_path / "drive", tmp_path / "clip"
    lens = {"width": 640, "height": 360, "fx": 400.0, "fy": 400.0, "cx": 329.5, "cy": 169.5}
    heights = {"front_camera": (10.0, 10.5), "left_camera": (9.7, 10.3)}
    cameras = {
        name: {**lens, "camera_to_world": [pose(PITCH, ROLL, z).tolist() for z in heights_m]}
        for name, heights_m in heights.items()
    }
    points = {
        "u": [100, 100, 101, 300, 310, 639],
        "v": [200, 200, 359, 100, 100, 50],
        "depth": [30.0, 10.0, 5.0, 20.0, 300.0, 50.0],
        "sem": [BUILDING, CAR, ROAD, OTHER, BUILDING, BUILDING],
    }
    for where, name, stems, times in (
        (front, "front_camera", ("00", "01"), 2),
        (folder, "left_camera", ("01",), 1),
    ):
        lidar = front / "lidar_depth_front" if where == front else folder / "lidar_labels" / name
        lidar.mkdir(parents=True)
        (where / name).mkdir(parents=True)
        for stem in stems:
            picture = np.full((360 * times, 640 * times, 3), (10, 60, 200), np.uint8)
            cv2.imwrite(str(where / name / f"{stem}.jpg"), picture)
            np.savez(
                lidar / f"{stem}.npz",
                u=np.array(points["u"], np.uint16) * times,
                v=np.array(points["v"], np.uint16) * times,
                depth=np.array(points["depth"], np.float16),
                sem=np.array(points["sem"], np.uint8),
            )
    (folder / "cameras.json").write_text(json.dumps({"cameras": cameras}))
    (folder / "semseg_classes.json").write_text(json.dumps(CLASSES))
    return folder, front


def planes(folder: Path, record: Record) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Labels, instances and steps of depth of a record."""
    assert record.labels is not None
    assert record.depth is not None
    labels = cv2.imread(str(folder / record.labels))
    depth = cv2.imread(str(folder / record.depth), cv2.IMREAD_UNCHANGED)
    assert labels is not None
    assert depth is not None
    return labels[..., 2], labels[..., 1], depth


def test_points_are_where_they_lie_in_the_smaller_picture(
    recording: tuple[Path, Path], tmp_path: Path
) -> None:
    records = pandaset_records(*recording, tmp_path / "out", HEIGHT_M)
    assert [each.image for each in records] == [
        "front_camera-00.jpg",
        "front_camera-01.jpg",
        "left_camera-01.jpg",
    ]
    for record in records:
        picture = cv2.imread(str(tmp_path / "out" / record.image))
        assert picture is not None
        assert picture.shape == (288, 512, 3)
        assert np.abs(picture.mean(axis=(0, 1)) - (10, 60, 200)).max() < 3
        labels, users, depth = planes(tmp_path / "out", record)
        # 0.8 pixels for one of 640: of two points in a pixel the nearer counts.
        for place, kind, user, depth_m in (
            ((160, 80), StreetClass.VEHICLE, UNKNOWN, 10),
            ((287, 81), StreetClass.ROAD, 0, 5),
            ((80, 240), UNKNOWN, UNKNOWN, 20),
            ((40, 511), StreetClass.STRUCTURE, 0, 50),
        ):
            assert (labels[place], users[place], depth[place]) == (kind, user, depth_m * DEPTH_STEPS)
        assert depth[80, 248] == FAR
        assert (depth > 0).sum() == 5
        assert (labels == UNKNOWN).sum() == labels.size - 4


def test_each_record_has_its_camera(recording: tuple[Path, Path], tmp_path: Path) -> None:
    records = pandaset_records(*recording, tmp_path / "out", HEIGHT_M)
    assert [each.camera_height_m for each in records] == pytest.approx([2.0, 2.0, 1.8])
    for record in records:
        assert record.focal_px == pytest.approx(320)
        assert record.roll_rad == pytest.approx(ROLL)
        assert (record.source, record.group, record.distorted) == ("pandaset", "drive", False)
        # The principal point, and where the horizon crosses its column; the middle is 8 pixels to the left.
        level = 170 * 0.8 - 144 + 320 * np.tan(PITCH) / np.cos(ROLL)
        assert record.horizon_px == pytest.approx(level + 8 * np.tan(ROLL))


@pytest.mark.parametrize(("pitch", "roll"), [(0.0, 0.0), (0.1, 0.0), (-0.2, 0.15), (0.05, -0.3)])
def test_level_directions_project_to_the_level_line(pitch: float, roll: float) -> None:
    camera = Camera(300, 310, 200, 110, 420, 240, pose(pitch, roll))
    horizon_px, roll_rad = level_line(camera)
    assert roll_rad == pytest.approx(roll)
    turns = np.linspace(-0.4, 0.4, 9)
    way = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    columns, rows, _ = camera.project(camera.world_from_camera[:3, 3] + way).T
    assert np.interp(210, columns[::-1], rows[::-1]) - 120 == pytest.approx(horizon_px)


def test_points_on_the_road_lie_below_the_horizon_by_the_camera_height(
    data_dir: Path, tmp_path: Path
) -> None:
    folder, front = data_dir / "training" / "pandaset_002", data_dir / "clips" / "pandaset_002"
    if not folder.is_dir():
        pytest.skip(f"DREAMDRIVE_DATA ({data_dir}) lacks training/pandaset_002")
    records = pandaset_records(folder, front, tmp_path, 2.1)
    assert len(records) == 103
    for record in records[::8]:
        labels, _, depth = planes(tmp_path, record)
        near = (depth > 0) & (depth < 20 * DEPTH_STEPS)
        rows, columns = np.nonzero(np.isin(labels, (StreetClass.ROAD, StreetClass.MARKING)) & near)
        assert record.horizon_px is not None
        assert record.roll_rad is not None
        horizon = 144 + record.horizon_px - (columns + 0.5 - 256) * np.tan(record.roll_rad)
        height_m = (rows + 0.5 - horizon) * depth[rows, columns] / DEPTH_STEPS / record.focal_px
        assert np.median(height_m) == pytest.approx(record.camera_height_m, rel=0.1), record.image


def test_what_is_unsure_or_moves_stays_unknown(tmp_path: Path) -> None:
    street = bare_street()
    geometry = true_geometry(street)
    assert geometry.ground is not None
    geometry.confidence[:, :, :20] = 0.5
    clip = street_clip(street, hold_out=3)
    records = clip_records(clip, geometry, "test", "street", tmp_path)
    kept = np.flatnonzero(~clip.held_out)
    assert len(records) == len(kept) < len(clip)
    for index, record in zip(kept, records, strict=True):
        assert record.labels is None
        assert record.focal_px == geometry.focal.px
        assert record.camera_height_m == pytest.approx(
            geometry.ground.height_m(geometry.cameras[index].world_from_camera[:3, 3])
        )
        assert record.depth is not None
        steps = cv2.imread(str(tmp_path / record.depth), cv2.IMREAD_UNCHANGED)
        known = (street.depth_m[index] > 0) & ~street.moving[index]
        known[:, :20] = False
        assert known.any()
        assert np.array_equal(steps > 0, known)
        near = known & (street.depth_m[index] < FAR / DEPTH_STEPS)
        assert np.allclose(steps[near] / DEPTH_STEPS, street.depth_m[index][near], atol=0.5 / DEPTH_STEPS)
        picture = cv2.imread(str(tmp_path / record.image))
        assert np.abs(picture[..., ::-1].astype(int) - clip.frames[index]).mean() < 4


def test_what_is_not_observed_stays_unknown(tmp_path: Path) -> None:
    geometry = true_geometry(bare_street())
    geometry = replace(geometry, ground=None, focal=replace(geometry.focal, observed=False))
    for record in clip_records(street_clip(bare_street()), geometry, "test", "street", tmp_path):
        assert (record.focal_px, record.camera_height_m) == (None, None)


def test_depth_that_was_not_measured_is_refused(tmp_path: Path) -> None:
    geometry = replace(true_geometry(bare_street()), fallback="the camera stands")
    with pytest.raises(InputError, match="street: the camera stands; expected a clip whose depth"):
        clip_records(street_clip(bare_street()), geometry, "test", "street", tmp_path)
