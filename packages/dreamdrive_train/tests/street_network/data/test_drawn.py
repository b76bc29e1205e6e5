"""Training records of drawn streets: readable, reproducible, and true."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.scene.street.layout import Lens, is_moving
from dreamdrive.scene.street.street_class import ROAD_USERS, StreetClass
from dreamdrive_train.street_network.data.drawn import (
    DrawnOptions,
    draw_records,
    draw_street_records,
    horizon_of,
)
from dreamdrive_train.street_network.data.records import DEPTH_STEPS, FAR, Record, read_records
from dreamdrive_train.street_network.data.viewpoints import Viewpoints, draw_lens
from streetworld import StreetOptions, World, draw_street, picture_of
from streetworld.edition2.layouts.held_back import Looks
from streetworld.engine.lens import pinhole

SEEDS = (1_000_031, 7)
OPTIONS = DrawnOptions(moments=2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("drawn")
    draw_records(SEEDS, made, OPTIONS, processes=1)
    return made


@pytest.fixture(scope="module")
def records(folder: Path) -> list[Record]:
    return list(read_records(folder))


def picture(folder: Path, name: str | None) -> np.ndarray:
    assert name is not None
    found = cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED)
    assert found is not None
    return found


def test_every_record_has_its_pictures_and_they_agree(folder: Path, records: list[Record]) -> None:
    assert len(records) == 12
    for record in records:
        image, labels, depth = (picture(folder, n) for n in (record.image, record.labels, record.depth))
        assert image.dtype == labels.dtype == np.uint8
        assert depth.dtype == np.uint16
        assert image.shape[:2] == labels.shape[:2] == depth.shape
        assert max(image.shape) == 512
        classes, instance = labels[..., 2], labels[..., 1]
        assert set(np.unique(classes)) <= {int(c) for c in StreetClass}
        assert (np.isin(classes, [int(c) for c in ROAD_USERS]) == (instance > 0)).all()
        unseen = np.isin(classes, [StreetClass.SKY, StreetClass.OWN_CAR])
        assert (depth[unseen] == 0).all()
        assert (depth[~unseen] > 0).all()
        assert not labels[..., 0].any()
        assert record.metric


def test_groups_tell_streets_apart_and_test_streets_are_kept_out(records: list[Record]) -> None:
    assert {record.group for record in records} == {"street-1000031", "street-7"}
    assert all(record.kept_out == (record.group == "street-7") for record in records)


def test_what_is_there_is_kept_and_drawn_again_the_same(
    folder: Path, records: list[Record], tmp_path: Path
) -> None:
    before = (folder / "7" / "records.jsonl").stat().st_mtime_ns
    steps: list[tuple[int, int]] = []
    again = draw_records(SEEDS, folder, OPTIONS, processes=1, progress=lambda *step: steps.append(step))
    assert again == records
    assert (folder / "7" / "records.jsonl").stat().st_mtime_ns == before
    assert steps == [(2, 2)]
    draw_street_records(7, tmp_path / "7", OPTIONS)
    for name in ("records.jsonl", "00.jpg", "03-labels.png", "03-depth.png"):
        assert (tmp_path / "7" / name).read_bytes() == (folder / "7" / name).read_bytes()


def test_depth_and_horizon_give_the_height_of_the_camera(folder: Path, records: list[Record]) -> None:
    """On level ground without distortion, road pixels lie a camera's height below it."""
    checked = 0
    for record in records:
        layout = draw_street(
            int(record.group.removeprefix("street-")), StreetOptions(OPTIONS.seconds + 1, edition=2)
        )
        if record.distorted or layout.relief.height_m > 0:
            continue
        assert record.focal_px is not None
        assert record.horizon_px is not None
        assert record.roll_rad is not None
        labels, depth = picture(folder, record.labels), picture(folder, record.depth)
        rows, columns = np.nonzero(np.isin(labels[..., 2], [StreetClass.ROAD]) & (depth < FAR))
        z = depth[rows, columns] / DEPTH_STEPS
        height, width = depth.shape
        x, y = (columns + 0.5 - width / 2) / record.focal_px, (rows + 0.5 - height / 2) / record.focal_px
        level = record.horizon_px / record.focal_px
        down = np.array([np.sin(record.roll_rad), np.cos(record.roll_rad)])
        below = z * (x * down[0] + (y - level) * down[1])
        below /= np.hypot(1, level * down[1])
        near = z < 30
        if near.sum() > 500:
            checked += 1
            # Only the edge of a kerb may stand out.
            assert np.quantile(np.abs(below[near] - record.camera_height_m), 0.95) < 0.03
    assert checked


def test_the_camera_sits_in_a_car_that_is_left_out_and_sees_something() -> None:
    world = World(draw_street(1_000_031, StreetOptions(3.0, edition=2, kind="city")))
    places = Viewpoints(world, np.random.default_rng(2), Looks(np.random.default_rng(2), False), 2.0)
    taken = 0
    for _ in range(12):
        places.move_on()
        at = places.draw()
        small = at.camera.resized(64, 36)
        changed = world.changed(world.layout.light, Lens(), at.ego)
        seen = picture_of(changed, places.moment, small, (at.time_s, small))
        assert (seen.depth_m[~seen.sky] > 0.3).all()
        assert places.seat is not None
        assert is_moving(places.seat.box.track)
        assert not (seen.instance == places.seat.instance).any()
        x, y, _ = places.seat.places(np.array([at.time_s]))[0]
        taken += np.hypot(*(at.camera.world_from_camera[:2, 3] - [x, y])) < 2.5
    assert taken > 1


def test_lenses_are_of_all_sorts() -> None:
    rng = np.random.default_rng(0)
    lenses = [draw_lens(rng, Looks(rng, True), (512, 288), ahead=True) for _ in range(400)]
    width = np.rad2deg([lens.hfov_rad for lens in lenses])
    assert width.min() < 40
    assert width.max() > 110
    assert np.mean((width > 45) & (width < 100)) > 0.8
    assert np.mean(np.abs([lens.pitch_rad for lens in lenses]) < np.deg2rad(4)) > 0.7
    assert np.mean(np.abs([lens.roll_rad for lens in lenses]) < np.deg2rad(1)) > 0.7
    bonnets = [lens.bonnet for lens in lenses if lens.bonnet is not None]
    assert 0.25 < len(bonnets) / len(lenses) < 0.42
    assert {look % 5 for look in bonnets} == {4}
    assert 0.2 < np.mean([lens.distortion != 0 for lens in lenses]) < 0.5
    for lens in lenses:
        corner = np.hypot(256, 144) / pinhole(lens, (512, 288)).fx_px
        assert lens.distortion > -0.148 / corner**2


def test_the_horizon_is_where_level_rays_cross_the_middle() -> None:
    world = World(draw_street(1_000_032, StreetOptions(3.0, edition=2)))
    places = Viewpoints(world, np.random.default_rng(4), Looks(np.random.default_rng(4), False), 2.0)
    for _ in range(6):
        at = places.draw()
        horizon, roll = horizon_of(at)
        far = 1e6
        ahead = at.camera.world_from_camera[:3, 2] * [1, 1, 0]
        points = []
        for side in (-0.02, 0.0, 0.02):
            turn = np.array([[np.cos(side), -np.sin(side), 0], [np.sin(side), np.cos(side), 0], [0, 0, 1]])
            points.append(at.camera.world_from_camera[:3, 3] + far * turn @ ahead)
        seen = at.camera.project(np.array(points))[:, :2] - [at.camera.cx_px, at.camera.cy_px]
        slope = (seen[0, 1] - seen[2, 1]) / (seen[0, 0] - seen[2, 0])
        assert np.arctan(slope) == pytest.approx(-roll, abs=1e-3)
        if at.lens.distortion == 0:
            assert seen[1, 1] - slope * seen[1, 0] == pytest.approx(horizon, abs=0.5)
