"""Samples of drives and of scenes."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.scene.street.log import Log, LogMap, OfLog
from dreamdrive.tasks.perception import (
    BevGrid,
    BevSample,
    ImageSize,
    PathOptions,
    SampleNote,
    draw_places,
    samples_of_log,
    samples_of_scene,
    span_of,
)
from dreamdrive.tasks.perception.of_scene import TOO_DOUBTFUL, TOO_LITTLE
from tests.logs import ego, log

IMAGE, GRID = ImageSize(24, 64, 12), BevGrid(40, 40)


@pytest.fixture
def drive(tmp_path) -> Log:
    return log(tmp_path / "made")


def scene_of(drive: Log) -> Scene:
    """Gaussians on the road, and the link to the drive: time 0 is the second picture of the front camera."""
    camera = drive.cameras[0]
    log_from_world = camera.world_from_camera[1]
    x, y = np.meshgrid(np.arange(180, 260, 0.5), np.arange(270, 340, 0.5))
    ground = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.1), np.ones(x.size)])
    means = (ground @ np.linalg.inv(log_from_world).T)[:, :3]
    count = len(means)
    gaussians = Gaussians(
        means=torch.tensor(means, dtype=torch.float32),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=torch.full((count, 3), float(np.log(0.4))),
        logit_opacities=torch.full((count,), 5.0),
        sh=torch.zeros(count, 1, 3),
        source_frame=torch.zeros(count, dtype=torch.int64),
    )
    rows = tuple(tuple(map(float, row)) for row in log_from_world)
    times_s = np.arange(10) / 10
    return Scene(
        static=gaussians,
        dynamic=gaussians.select(torch.zeros(0, dtype=torch.int64)),
        deformation=None,
        actors=(),
        sky=None,
        exposure=None,
        cameras=tuple(camera.pinhole for _ in times_s),
        times_s=times_s,
        held_out=np.zeros(10, bool),
        provenance=Provenance(log=OfLog(drive.name, rows, float(camera.times_s[1]))),
    )


def test_a_recorded_sample_is_as_the_cameras_saw_it(drive):
    notes = [note for note, _ in samples_of_log(drive, IMAGE, GRID)]
    assert [note.time_s for note in notes] == [0.0, 0.5, 1.0]
    assert [each.name for each in notes[0].cameras] == ["CAM_FRONT", "CAM_BACK_LEFT"]
    pose = np.array(notes[0].cameras[0].camera_from_ego)
    np.testing.assert_allclose(pose[:3, 3], [0.2, 1.4, -1.5], atol=1e-3)
    k = np.array(notes[0].cameras[0].pixel_from_camera)
    assert k[0, 2] == pytest.approx(32.0)
    assert k[1, 2] == pytest.approx(23.0 * 36 / 48 - 12)


def test_fewer_samples_are_spread(drive):
    assert [n.time_s for n, _ in samples_of_log(drive, IMAGE, GRID, most=2)] == [0.0, 1.0]


def test_a_drive_without_a_map_is_refused(drive):
    with pytest.raises(InputError, match="has no map, and labels of the road are drawn from it"):
        next(samples_of_log(replace(drive, map=LogMap()), IMAGE, GRID))


def test_the_drivable_area_stands_for_roads(drive):
    labels = next(samples_of_log(drive, IMAGE, GRID))[1].labels
    assert labels.road().mean() > 0.1
    assert not labels.layers[0].any()


def test_places_lie_beside_the_path(drive):
    options = PathOptions(aside_m=1.5, turned_deg=6.0)
    places, near = draw_places(drive, (0.0, 1.0), 20, options, seed=1)
    assert len(places) + near == 20
    for place in places:
        along = np.linalg.inv(ego(place.time_s)) @ place.world_from_ego
        assert along[1, 3] == pytest.approx(place.aside_m, abs=0.02)
        assert abs(place.aside_m) <= 1.5
        assert abs(place.turned_rad) <= np.deg2rad(6.0)
    assert [p.time_s for p in places] == sorted(p.time_s for p in places)
    again, _ = draw_places(drive, (0.0, 1.0), 20, options, seed=1)
    np.testing.assert_array_equal(again[3].world_from_ego, places[3].world_from_ego)


def test_a_car_that_stands_gives_few_places(drive):
    standing = replace(drive, world_from_ego=np.repeat(drive.world_from_ego[:1], 3, axis=0))
    options = PathOptions(aside_m=0.1, turned_deg=0.1, apart_s=5.0)
    places, near = draw_places(standing, (0.0, 1.0), 20, options, seed=1)
    assert len(places) == 1
    assert near == 19


def test_a_scene_is_seen_from_new_places(drive):
    scene, options = scene_of(drive), PathOptions(least_covered=0.2)
    span = span_of(scene, drive)
    assert span == pytest.approx((0.0, 0.9))
    places, _ = draw_places(drive, span, 4, options, seed=2)
    made = [
        each
        for each in samples_of_scene(scene, drive, places, IMAGE, GRID, options)
        if not isinstance(each, str)
    ]
    assert len(made) == 4
    note, sample = made[0]
    assert (note.kind, note.prior) == ("rendered", None)
    assert note.covered > 0.5
    # The road is grey below the horizon, and there is nothing above it.
    assert sample.pictures[0, :, -1].mean() > 80
    assert sample.labels.vehicle().any()
    assert sample.labels.visibility[sample.labels.vehicle() > 0].min() >= 1


def test_labels_of_a_new_place_are_those_of_the_moved_car(drive):
    scene, options = scene_of(drive), PathOptions(aside_m=0.0, turned_deg=0.0, least_covered=0.0)
    places, _ = draw_places(drive, (0.499, 0.501), 1, options, seed=0)
    ((_, rendered),) = samples_of_scene(scene, drive, places, IMAGE, GRID, options)
    recorded = list(samples_of_log(drive, IMAGE, GRID))[1][1]
    assert (rendered.labels.road() == recorded.labels.road()).mean() > 0.97
    both = (rendered.labels.vehicle() > 0) & (recorded.labels.vehicle() > 0)
    assert both.sum() >= 0.7 * recorded.labels.vehicle().sum()
    np.testing.assert_allclose(rendered.pixel_from_camera, recorded.pixel_from_camera, atol=1e-3)
    np.testing.assert_allclose(rendered.camera_from_ego[0], recorded.camera_from_ego[0], atol=0.02)


def test_on_hills_car_and_boxes_stand_on_the_level_road_of_the_scene(drive):
    """A street was drawn level, and its log climbs by 3 m with a pitched car: samples are as without."""
    level = scene_of(drive)
    link = replace(level.provenance.log, level_z_m=0.1)
    level = replace(level, provenance=Provenance(log=link, prior="street-world"))
    pitched = np.eye(4)
    pitched[[0, 0, 2, 2], [0, 2, 0, 2]] = np.cos(0.1), -np.sin(0.1), np.sin(0.1), np.cos(0.1)
    climbing = drive.world_from_ego @ pitched
    climbing[:, 2, 3] += [1.0, 2.0, 3.0]
    lifted = np.eye(4)
    lifted[2, 3] = 2.0
    boxes = tuple(replace(box, world_from_box=lifted @ box.world_from_box) for box in drive.boxes)
    hilly = replace(drive, world_from_ego=climbing, boxes=boxes)
    options = PathOptions(aside_m=0.0, turned_deg=0.0, least_covered=0.0)

    def made(scene: Scene, log: Log) -> tuple[SampleNote, BevSample]:
        places, _ = draw_places(log, (0.499, 0.501), 1, options, seed=0)
        (sample,) = samples_of_scene(scene, log, places, IMAGE, GRID, options)
        return sample

    (note, flat), (_, climbed) = made(level, drive), made(level, hilly)
    assert note.prior == "street-world"
    np.testing.assert_allclose(flat.camera_from_ego, climbed.camera_from_ego, atol=1e-5)
    np.testing.assert_array_equal(flat.labels.bits(), climbed.labels.bits())
    np.testing.assert_array_equal(flat.labels.visibility, climbed.labels.visibility)
    assert np.abs(flat.pictures.astype(int) - climbed.pictures).mean() < 1
    as_in_log = replace(level, provenance=Provenance(log=replace(link, level_z_m=None)))
    assert np.abs(flat.pictures.astype(int) - made(as_in_log, hilly)[1].pictures).mean() > 10


def test_what_the_scene_does_not_cover_is_left_out(drive):
    scene = scene_of(drive)
    empty = replace(scene, static=scene.static.select(torch.arange(5)))
    places, _ = draw_places(drive, (0.0, 0.9), 3, PathOptions(), seed=2)
    assert list(samples_of_scene(empty, drive, places, IMAGE, GRID, PathOptions())) == [TOO_LITTLE] * 3


def test_what_cannot_be_believed_as_asked_is_left_out(drive):
    scene = scene_of(drive)
    camera = scene.cameras[0]
    blocks = len(scene.cameras), camera.height_px // 8, camera.width_px // 8
    known = replace(scene, residual=np.full(blocks, 0.02, np.float16))
    places, _ = draw_places(drive, (0.0, 0.9), 2, PathOptions(), seed=2)

    def made(scene: Scene, least_db: float) -> list[bool]:
        options = PathOptions(least_covered=0.2, least_psnr_db=least_db)
        found = samples_of_scene(scene, drive, places, IMAGE, GRID, options)
        return [each == TOO_DOUBTFUL for each in found]

    assert made(known, 5.0) == [False, False]
    assert made(known, 60.0) == [True, True]
    with pytest.raises(InputError, match="off its frames"):
        made(scene, 20.0)


def test_labels_of_another_drive_are_refused(drive):
    scene = scene_of(drive)
    with pytest.raises(InputError, match="the scene was made of scene-0001, the labels are of other"):
        span_of(scene, replace(drive, name="other"))
    with pytest.raises(InputError, match="made of no drive of a data set"):
        span_of(replace(scene, provenance=Provenance()), drive)


def test_times_have_to_meet(drive):
    scene = scene_of(drive)
    with pytest.raises(InputError, match="have no time in common"):
        span_of(replace(scene, times_s=scene.times_s + 100), drive)
