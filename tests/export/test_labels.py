"""Labels of the drive that a scene was made of, beside the scene's own actors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.datasets.nuscenes import read_nuscenes
from dreamdrive.datasets.nuscenes.log import scenes_of_nuscenes
from dreamdrive.errors import InputError
from dreamdrive.export import Labels, export_scene, labels_of
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.log import BoxTrack, Log
from tests.export.scenes_of_drives import upright_scene_of
from tests.logs import log, track


@pytest.fixture
def drive(tmp_path: Path) -> Log:
    """A car that drives, and at both sides of its way a lorry and a cone."""
    made = log(tmp_path / "made")
    car, lorry, cone = made.boxes
    lorry = replace(moved(lorry, 8.0), attributes=(("vehicle.parked", "own.word"),) * 2)
    return replace(made, boxes=(car, lorry, moved(cone, -6.0)))


def moved(box: BoxTrack, aside_m: float) -> BoxTrack:
    poses = box.world_from_box.copy()
    poses[:, 1, 3] += aside_m
    return replace(box, world_from_box=poses)


def with_actor(drive: Log, label: BoxTrack, aside_m: float = 0.3) -> Scene:
    """A scene of the drive with an actor where a thing is labelled, a bit aside."""
    scene = upright_scene_of(drive)
    link = scene.provenance.log
    assert link is not None
    world_from_log = np.linalg.inv(np.array(link.log_from_world))
    bottom = label.world_from_box[:, :3, 3] + [0, aside_m, -0.8]
    places_m = bottom @ world_from_log[:3, :3].T + world_from_log[:3, 3]
    ahead = world_from_log[:3, :3] @ label.world_from_box[0, :3, 0]
    size_m = np.array([4.0, 1.8, 1.5])
    seen = Track(label.times_s - link.start_s, places_m, np.zeros(len(places_m)))
    actor = Actor(0, "actor 0", "vehicle", 0, seen, ActorBox(size_m, ahead))
    return replace(scene, actors=(actor,))


def test_what_the_scene_holds_as_an_actor_is_not_there_twice(drive: Log) -> None:
    for k, label in enumerate(drive.boxes):
        kept = labels_of(with_actor(drive, label), drive).boxes
        assert [box.id for box in kept] == [box.id for i, box in enumerate(drive.boxes) if i != k]


def test_what_moves_may_be_metres_off_and_what_stands_may_not(drive: Log) -> None:
    def kept(label: int, aside_m: float) -> list[str]:
        return [box.id for box in labels_of(with_actor(drive, drive.boxes[label], aside_m), drive).boxes]

    assert "car" not in kept(0, 3.5)
    assert "car" in kept(0, 6.5)
    assert "parked" in kept(1, 3.5)


def test_of_an_edited_scene_only_what_stands_is_taken(drive: Log) -> None:
    scene = replace(with_actor(drive, drive.boxes[0]), actors=())
    assert [box.id for box in labels_of(scene, drive).boxes] == ["car", "parked", "cone"]
    assert [box.id for box in labels_of(scene, drive, edited=True).boxes] == ["parked", "cone"]


def test_labels_are_written_where_the_drive_has_them(drive: Log, tmp_path: Path) -> None:
    scene = with_actor(drive, drive.boxes[0])
    export_scene(scene, tmp_path / "set", labels=labels_of(scene, drive))
    found = read_nuscenes(tmp_path / "set", "set")
    assert found.problems == ()
    assert found.location == drive.location
    boxes = {box.category: box for box in found.boxes}
    assert set(boxes) == {"vehicle.car", "vehicle.truck", "movable_object.trafficcone"}
    parked, true = boxes["vehicle.truck"], drive.boxes[1]
    assert parked.id == "parked"
    np.testing.assert_allclose(parked.world_from_box[0], true.world_from_box[0], atol=1e-6)
    np.testing.assert_allclose(parked.size_lwh_m[0], true.size_lwh_m[0])
    assert parked.attributes[0] == ("vehicle.parked", "own.word")
    # Its label ends half a second into the drive, 0.6 s after the scene begins.
    assert len(parked.times_s) == 2
    # The actor is where the scene has it, with its own size.
    car = boxes["vehicle.car"]
    np.testing.assert_allclose(car.size_lwh_m[0], [4.0, 1.8, 1.5])
    link = scene.provenance.log
    assert link is not None
    first = drive.boxes[0].pose_at(float(car.times_s[0]) + link.start_s)
    assert first is not None
    np.testing.assert_allclose(car.world_from_box[0, :2, 3], first[:2, 3] + [0, 0.3], atol=0.05)
    outline = found.map.areas["drivable_area"][0].outline
    np.testing.assert_allclose(outline, drive.map.areas["drivable_area"][0].outline)
    poses = drive.cameras[0].world_from_camera
    np.testing.assert_allclose(found.cameras[0].world_from_camera[0], poses[1], atol=1e-6)


def test_on_a_level_road_things_stand_upright(drive: Log) -> None:
    scene = with_actor(drive, drive.boxes[0])
    assert scene.provenance.log is not None
    level = replace(scene.provenance, log=replace(scene.provenance.log, level_z_m=2.0))
    made = labels_of(replace(scene, provenance=level), drive).at(scene.times_s)
    for each in made:
        np.testing.assert_allclose(each.world_from_box[:, 2, 3], 2.0 + each.size_lwh_m[2] / 2)
        np.testing.assert_allclose(each.world_from_box[:, 2, 2], 1)


def test_labels_of_another_drive_are_refused(drive: Log) -> None:
    scene = with_actor(drive, drive.boxes[0])
    with pytest.raises(InputError, match="the scene was made of scene-0001, the labels are of other"):
        labels_of(scene, replace(drive, name="other"))
    with pytest.raises(InputError, match="no drive of a data set"):
        labels_of(replace(scene, provenance=replace(scene.provenance, log=None)), drive)


def test_real_labels_of_pandaset_are_carried_along(data_dir: Path) -> None:
    """Of a real drive, all that is labelled at its time and near is one of the things at that time."""
    folder = data_dir / "nuscenes_format" / "pandaset_002"
    drive = read_nuscenes(folder, scenes_of_nuscenes(folder)[0])
    scene = upright_scene_of(drive)
    labels = labels_of(scene, drive)
    assert isinstance(labels, Labels)
    made = {each.id: each for each in labels.at(scene.times_s)}
    assert scene.provenance.log is not None
    for box in drive.boxes:
        rows = np.flatnonzero(np.abs(box.times_s - scene.provenance.log.start_s - scene.times_s[0]) < 1e-3)
        for row in rows:
            np.testing.assert_allclose(made[box.id].world_from_box[0], box.world_from_box[row], atol=1e-6)
            assert made[box.id].attributes is not None
            assert made[box.id].attributes[0] == box.attributes[row]
    assert any(each.category.startswith("human") for each in made.values())


def test_a_standing_thing_beside_the_path_of_an_actor_is_kept(drive: Log) -> None:
    beside = moved(track("beside", "vehicle.car", 0.0), 3.0)
    more = replace(drive, boxes=(*drive.boxes, beside))
    assert "beside" in [box.id for box in labels_of(with_actor(more, drive.boxes[0]), more).boxes]
