"""Scenes of data sets as streets: what map-conditioned priors are given."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.data.input import log_of, read_dataset
from dreamdrive.data.layout_file import write_layout
from dreamdrive.data.planned import Planned
from dreamdrive.datasets.log_layout import layout_of_log
from dreamdrive.datasets.logs import told_of_street
from dreamdrive.datasets.nuscenes import read_nuscenes
from dreamdrive.errors import InputError
from dreamdrive.export import export_world
from dreamdrive.files.digest import digest
from dreamdrive.prior.replay import REPLAY
from dreamdrive.prior.street import (
    StreetSource,
    map_from_cameras,
    place_in_log,
    read_street,
    wanted_frames,
)
from dreamdrive.run.request import request_of
from dreamdrive.scene.control import Control
from dreamdrive.scene.street.layout import track_function
from dreamdrive.scene.street.log import LogMap
from dreamdrive.scene.street.truth import MOUNTS, DriveTruth, Mount
from streetworld import StreetOptions, World, draw_street, drive
from streetworld.prior import STREET_WORLD
from tests.logs import ego


def street_at(path: Path, without: str | None = None, **chosen: str) -> StreetSource:
    return read_street(STREET_WORLD.open(Control(path, **chosen)), path, without)  # type: ignore[arg-type]


def test_a_scene_is_a_street_with_the_cameras_that_are_asked_for(one_drive: Path) -> None:
    street = street_at(one_drive)
    drive = log_of(Control(one_drive))
    assert drive is not None
    assert street.layout == layout_of_log(drive)
    assert street.name == "the scene scene-0001 of set"
    assert [camera.name for camera in street.cameras] == ["CAM_FRONT"]
    both = street_at(one_drive, without="all")
    assert [camera.name for camera in both.cameras] == ["CAM_FRONT", "CAM_BACK_LEFT"]
    back = street_at(one_drive, cameras="back_left", without="all")
    assert [camera.name for camera in back.cameras] == ["CAM_BACK_LEFT"]


def test_a_layout_has_no_scenes_and_a_folder_without_any_is_none(tmp_path: Path) -> None:
    write_layout(draw_street(3), tmp_path / "street.json")
    assert street_at(tmp_path / "street.json").log is None
    with pytest.raises(InputError, match=r"^--scene and --cameras choose of a data set, and .*street\.json"):
        street_at(tmp_path / "street.json", scene="0", cameras="all")
    with pytest.raises(InputError, match="is a folder that holds no scenes with maps and boxes; expected a"):
        street_at(tmp_path)
    with pytest.raises(InputError, match="--cameras choose of a data set, and there is no input"):
        STREET_WORLD(Control(cameras="all"))


def test_a_scene_ends_with_its_last_label(one_drive: Path) -> None:
    street = street_at(one_drive)
    assert wanted_frames(Control(), 24, 10.0, street) == range(11)
    assert wanted_frames(Control(frames="2:"), 4, 10.0, street) == range(2, 6)
    assert wanted_frames(Control(frames="-3:"), 24, 10.0, street) == range(8, 11)
    with pytest.raises(InputError, match=r"asks for frame 11, but the scene .* has only 11 frames"):
        wanted_frames(Control(frames="0:12"), 24, 10.0, street)
    with pytest.raises(InputError, match="selects no frame: the scene scene-0001 of set has 11 frames at 10"):
        wanted_frames(Control(frames="11:"), 24, 10.0, street)
    with pytest.raises(InputError, match="--fps 0: expected more than 0"):
        wanted_frames(Control(), 24, 0.0, street)


def test_cameras_stand_where_they_are_mounted(one_drive: Path) -> None:
    street = street_at(one_drive, without="all")
    times_s = np.array([0.0, 0.5])
    poses = map_from_cameras(street, times_s)
    assert poses.shape == (2, 2, 4, 4)
    mounted = [camera.ego_from_camera for camera in street.cameras]
    for pose in poses:
        np.testing.assert_allclose(
            np.linalg.inv(pose[0]) @ pose[1], np.linalg.inv(mounted[0]) @ mounted[1], atol=1e-9
        )
    path = track_function(street.layout.ego.track)(times_s)
    np.testing.assert_allclose(poses[:, 0, :2, 3], path[:, :2], atol=1e-9)
    np.testing.assert_allclose(poses[:, 0, 2, 3], 1.4)
    whole = np.stack([ego(t) @ mounted[0] for t in times_s])  # its car is level, too
    np.testing.assert_allclose(poses[:, 0, :3, :3], whole[:, :3, :3], atol=1e-6)


def test_frames_have_the_pinholes_of_the_recording(one_drive: Path) -> None:
    """And its mountings and poses, up to the tilt of a car that is level here as well."""
    asked = Control(one_drive, cameras="all", frames="0:3", size=(32, 24))
    clip = STREET_WORLD(asked)
    read = read_dataset(asked)
    assert [camera.matrix.tolist() for camera in clip.rig] == [camera.matrix.tolist() for camera in read.rig]
    for made, real in zip(clip.rig, read.rig, strict=True):
        np.testing.assert_allclose(made.world_from_camera, real.world_from_camera)
    assert clip.frames.shape == (6, 24, 32, 3)
    assert clip.camera.tolist() == [0, 1] * 3
    np.testing.assert_allclose(clip.times_s, np.repeat([0.0, 0.1, 0.2], 2))
    assert clip.known.intrinsics
    assert clip.known.world_from_camera is not None
    assert read.known.world_from_camera is not None
    later = read_dataset(replace(asked, frames="1:4"))  # the recording starts 0.1 s before time 0
    assert later.known.world_from_camera is not None
    front, real = (each.known.world_from_camera[::2] for each in (clip, later))  # the others are late
    np.testing.assert_allclose(front, real, atol=2e-3)
    assert clip.provenance["cameras"] == ["CAM_FRONT", "CAM_BACK_LEFT"]
    one = STREET_WORLD(replace(asked, cameras=None))
    assert (one.rig[0].world_from_camera == np.eye(4)).all()
    np.testing.assert_array_equal(one.frames, clip.frames[::2])


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A level street that bends, as six cameras of a car that nods and rolls see it."""
    layout = draw_street(4, StreetOptions(seconds=1.2))
    world = World(layout)
    seen: dict[Mount, DriveTruth] = {
        m: drive(layout, 11, 10.0, (32, 24), world=world, mount=m, antialiased=False) for m in MOUNTS
    }
    folder = tmp_path_factory.mktemp("drawn") / "street"
    export_world(seen, "street", folder)
    return folder


@pytest.mark.parametrize(("cameras", "count"), [(None, 1), ("all", 6), ("back_left,front", 2)])
def test_a_clip_lies_where_the_cameras_of_its_log_are(drawn: Path, cameras: str | None, count: int) -> None:
    """The layout has the car's way at labels, each half a second, and a spline between: not when it swerves,
    as drawn cars do in their first half second."""
    clip = STREET_WORLD(Control(drawn, cameras=cameras, frames="6:11", size=(32, 24)))
    recorded = read_nuscenes(drawn, "street")
    link, poses = clip.log, clip.known.world_from_camera
    assert link is not None
    assert poses is not None
    assert (link.name, link.start_s) == ("street", pytest.approx(0.6))
    assert len(clip.rig) == count
    for index, pose in enumerate(np.array(link.log_from_world) @ poses):
        camera = recorded.camera(clip.provenance["cameras"][clip.camera[index]])
        row = int(np.abs(camera.times_s - (link.start_s + clip.times_s[index])).argmin())
        real = camera.world_from_camera[row]
        np.testing.assert_allclose(pose[:3, 3], real[:3, 3], atol=0.05)
        yaw, true = (np.arctan2(each[1, 2], each[0, 2]) for each in (pose, real))
        assert abs((yaw - true + np.pi) % (2 * np.pi) - np.pi) < np.deg2rad(0.5)


def test_a_level_road_lies_as_high_as_the_car_at_the_start(one_drive: Path) -> None:
    """The log climbs, and its car is pitched; the layout knows nothing of it."""
    street = street_at(one_drive, without="all")
    assert street.log is not None
    slope = np.eye(4)
    slope[[0, 0, 2, 2], [0, 2, 0, 2]] = np.cos(0.1), -np.sin(0.1), np.sin(0.1), np.cos(0.1)
    climbing = street.log.world_from_ego @ slope
    climbing[:, 2, 3] += [0.0, 2.0, 4.0]
    link = place_in_log(replace(street, log=replace(street.log, world_from_ego=climbing)), 0.75)
    assert link.level_z_m == pytest.approx(3.1)
    pose = np.array(link.log_from_world)
    assert pose[2, 3] == pytest.approx(3.1 + 1.4)
    np.testing.assert_allclose(
        pose[:3, :3], (ego(0.75) @ street.cameras[0].ego_from_camera)[:3, :3], atol=1e-3
    )
    np.testing.assert_allclose(pose[:2, 3], (ego(0.75) @ street.cameras[0].ego_from_camera)[:2, 3], atol=2e-2)


def test_a_layout_is_of_no_log(tmp_path: Path) -> None:
    write_layout(draw_street(3), tmp_path / "street.json")
    assert STREET_WORLD(Control(tmp_path / "street.json", frames="0:2", size=(32, 24))).log is None


def test_what_a_scene_does_not_tell_is_said(one_drive: Path) -> None:
    notes = " ".join(STREET_WORLD(Control(one_drive, frames="0:1", size=(32, 24))).provenance["notes"])
    assert (
        "simulated: frames of the scene scene-0001 of set, handed over with exact intrinsics and poses"
        in notes
    )
    assert "has no carpark_area, ped_crossing, road_divider: they are not drawn" in notes
    assert "of these kinds are not drawn: movable_object.trafficcone" in notes


def test_without_a_map_all_is_grass(one_drive: Path, tmp_path: Path) -> None:
    own = shutil.copytree(one_drive, tmp_path / "set")
    for name in ("map", "log"):
        (own / "v1.0-mini" / f"{name}.json").unlink()
    notes = STREET_WORLD(Control(own, frames="0:1", size=(32, 24))).provenance["notes"]
    assert any("walkway" in note and "all ground is grass" in note for note in notes)


def test_boxes_map_and_calibration_count_and_pictures_do_not(one_drive: Path, tmp_path: Path) -> None:
    own = shutil.copytree(one_drive, tmp_path / "set")
    control = Control(own)
    before = (STREET_WORLD.open(control).digest, REPLAY.open(control).digest)
    assert request_of(control, prior="street-world").digests["input"] == before[0]
    drive = log_of(control)
    assert drive is not None
    drive.cameras[0].files[0].write_bytes(drive.cameras[0].files[1].read_bytes())
    after = (STREET_WORLD.open(control).digest, REPLAY.open(control).digest)
    assert after[0] == before[0]
    assert after[1] != before[1]
    seen = {before[0], digest(told_of_street(replace(drive, map=LogMap())))}
    for table, key in (("calibrated_sensor", "translation"), ("sample_annotation", "size")):
        file = own / "v1.0-mini" / f"{table}.json"
        rows = json.loads(file.read_text())
        for row in rows:
            row[key] = [value + 0.1 for value in row[key]]
        file.write_text(json.dumps(rows))
        seen.add(STREET_WORLD.open(control).digest)
    assert len(seen) == 4


def test_a_layout_has_the_digest_of_its_file(tmp_path: Path) -> None:
    write_layout(draw_street(3), tmp_path / "street.json")
    assert STREET_WORLD.open(Control(tmp_path / "street.json")).digest is None


def test_the_cost_is_that_of_the_scene(one_drive: Path) -> None:
    planned = STREET_WORLD.open(Control(one_drive, cameras="all", frames="0:10:3")).plan
    assert planned == Planned(4, 2, (64, 48), None, 0, 3, chosen=True)
    assert STREET_WORLD.open(Control(one_drive)).plan == Planned(11, 1, (64, 48), None, 0, 1, chosen=True)
