"""The benchmark of the street network: its figures where the truth is known, and its recordings."""

from dataclasses import replace
from math import radians, tan
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.look import CameraEstimate
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.scene.street.truth import Semantic
from dreamdrive_bench.knowledge import lidar, shots
from dreamdrive_bench.knowledge.cameras import errors_deg
from dreamdrive_bench.recorded.lidar import PEOPLE, VEHICLES
from dreamdrive_train.street_network.data.drawn import CLASS_OF

PINHOLE = Camera(100, 100, 50, 30, 100, 60)
VEHICLE, PERSON, ROAD = 13, 30, 7


@pytest.fixture(autouse=True)
def labels(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {VEHICLES: {VEHICLE}, PEOPLE: {PERSON}}
    monkeypatch.setattr(lidar, "labels", found.__getitem__)


def shot(depth_m: np.ndarray, label: int | np.ndarray = ROAD, camera: str = "front") -> shots.Shot:
    """Points along a row."""
    place_px = np.column_stack([np.arange(len(depth_m)) + 0.5, np.full(len(depth_m), 40.5)])
    labels = np.broadcast_to(label, depth_m.shape).astype(int)
    return shots.Shot(camera, Path("none.jpg"), PINHOLE, 1.5, place_px, depth_m, labels)


def row_of(depth: np.ndarray, kind: StreetClass = StreetClass.ROAD) -> lidar.Seen:
    """The same depth in every row."""
    return np.broadcast_to(depth, (60, 100)), np.full((60, 100), kind, np.uint8)


def test_depth_is_judged_up_to_a_factor() -> None:
    true_m = np.linspace(3, 70, 100)
    figures = lidar.judge([shot(true_m)], lambda _: row_of(true_m / 7))
    assert figures["abs_rel"] == pytest.approx(0, abs=1e-9)
    off = np.where(np.arange(100) % 2, 0.9, 1.1)
    figures = lidar.judge([shot(true_m)], lambda _: row_of(true_m * off))
    assert figures["abs_rel"] == pytest.approx(0.1, abs=0.02)


def test_errors_are_means_over_cameras() -> None:
    """Three pictures of one camera weigh as much as one of another."""
    true_m = np.full(100, 10.0)
    half = np.where(np.arange(100) < 60, 10.0, 20.0)
    many = [shot(true_m), shot(true_m), shot(true_m), shot(true_m, camera="back")]
    figures = lidar.judge(many, lambda each: row_of(half if each.camera == "back" else true_m))
    assert figures["abs_rel_of_cameras"] == {"front": 0, "back": pytest.approx(0.4)}
    assert figures["abs_rel"] == pytest.approx(0.2)
    assert figures["pictures"] == 4


def test_far_points_and_missing_depth() -> None:
    true_m = np.array([10.0] * 60 + [40.0] * 20 + [200.0] * 20)
    said = np.array([10.0] * 60 + [0.0] * 20 + [5.0] * 20)
    figures = lidar.judge([shot(true_m)], lambda _: row_of(said))
    # Where nothing is seen the depth counts as 80 m; what is farther than that does not count.
    assert figures["abs_rel"] == pytest.approx(20 / 80)


def test_points_of_road_users_are_pooled() -> None:
    label = np.array([VEHICLE] * 40 + [PERSON] * 10 + [ROAD] * 50)
    seen = np.full((60, 100), StreetClass.ROAD, np.uint8)
    seen[:, :30], seen[:, 50:60], seen[:, 45:50] = (
        StreetClass.VEHICLE,
        StreetClass.VEHICLE,
        StreetClass.TWO_WHEELER,
    )
    figures = lidar.judge([shot(np.full(100, 10.0), label)], lambda _: (np.ones((60, 100)), seen))
    assert figures["vehicles"] == {"points": 40, "iou": 30 / 50, "recall": 30 / 40, "precision": 30 / 40}
    assert figures["people_and_two_wheelers"]["iou"] == 5 / 10
    assert figures["vehicle_abs_rel"] == pytest.approx(0)


def test_a_network_that_sees_sky_alone_is_as_wrong_as_can_be() -> None:
    figures = lidar.judge([shot(np.full(100, 8.0))], lambda _: row_of(np.zeros(100)))
    assert figures["abs_rel"] == pytest.approx(9)


def test_the_baseline_is_right_about_a_level_road() -> None:
    found, classes = lidar.plane_and_backdrop(shot(np.full(100, 10.0)))
    assert classes is None
    assert found[40, 50] == pytest.approx(1.5 * 100 / 10.5)
    assert found[0, 0] == 40


def test_angles_of_the_camera() -> None:
    pitch, up = radians(5), np.array([0.0, -1, 0])
    said = CameraEstimate(480, 270, 400, 0.1, 400 * tan(pitch), 1, 0.0, 0.1, 0.0)
    # Turned about x by a positive angle a camera of x right and y down looks up.
    c, s = np.cos(pitch), np.sin(pitch)
    pose = np.eye(4)
    pose[1:3, 1:3] = [[c, -s], [s, c]]
    true = Camera(400, 400, 240, 135, 480, 270, pose)
    assert np.allclose(errors_deg(said, true, up), 0, atol=1e-6)
    assert errors_deg(said, true.at(np.eye(4)), up)[0] == pytest.approx(5)
    pose = np.eye(4)
    pose[:2, :2] = [[c, -s], [s, c]]
    assert errors_deg(said, true.at(pose), up)[1] == pytest.approx(5)
    assert errors_deg(replace(said, roll_rad=pitch), true.at(pose), up)[1] == pytest.approx(0, abs=1e-6)


def test_every_class_of_drawn_streets_is_one_of_the_networks() -> None:
    every = np.array([int(each) for each in Semantic], np.uint8)
    assert len(CLASS_OF) == len(every)
    assert CLASS_OF[every][Semantic.BUS] == StreetClass.VEHICLE


def test_recordings_with_lidar(data_dir: Path) -> None:
    first = {each.camera: each for each in shots.pandaset()}
    assert len(first) == 6
    for each in [*first.values(), next(shots.kitti())]:
        assert each.frame().shape == (each.pinhole.height_px, each.pinhole.width_px, 3)
        assert 1.4 < each.height_m < 2.3
        rows, columns = each.pixels()
        assert len(rows) == len(columns) == len(each.depth_m)
