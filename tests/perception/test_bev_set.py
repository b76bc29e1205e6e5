"""Samples on disk come back as they were."""

import json

import numpy as np
import pytest
from tests.logs import log

from dreamdrive.errors import InputError
from dreamdrive.perception import BevGrid, BevSet, ImageSize, samples_of_log, write_bev_set

IMAGE, GRID = ImageSize(24, 64, 12), BevGrid(40, 40)


@pytest.fixture
def samples(tmp_path):
    return list(samples_of_log(log(tmp_path / "made"), IMAGE, GRID))


@pytest.fixture
def written(tmp_path, samples):
    write_bev_set(samples, tmp_path / "set", IMAGE, GRID, count=3, suffix="png")
    return tmp_path / "set"


def test_what_is_written_is_read(written, samples):
    read = BevSet.open(written)
    assert (read.image, read.grid, len(read)) == (IMAGE, GRID, 3)
    for index, (note, sample) in enumerate(samples):
        again = read[index]
        assert read.notes[index] == note
        np.testing.assert_array_equal(again.pictures, sample.pictures)
        np.testing.assert_array_equal(again.pixel_from_camera, sample.pixel_from_camera)
        np.testing.assert_array_equal(again.camera_from_ego, sample.camera_from_ego)
        np.testing.assert_array_equal(again.labels.layers, sample.labels.layers)
        np.testing.assert_array_equal(again.labels.visibility, sample.labels.visibility)
        np.testing.assert_array_equal(again.labels.auxiliary, sample.labels.auxiliary)


def test_sets_from_before_priors_were_told_are_read(written):
    values = json.loads((written / "manifest.json").read_text())
    assert {sample.pop("prior") for sample in values["samples"]} == {None}
    (written / "manifest.json").write_text(json.dumps(values))
    assert [note.prior for note in BevSet.open(written).notes] == [None] * 3


def test_labels_show_road_and_cars(samples):
    labels = samples[0][1].labels
    assert labels.road().any()
    assert labels.vehicle().any()
    rows, columns = np.nonzero(labels.vehicle())
    # The car stands 15 m ahead of a car at (200, 300) that looks 0.2 rad to the left.
    assert rows.mean() == pytest.approx(20 - 15.1 * 0.4, abs=1.5)
    assert columns.mean() == pytest.approx(20, abs=1.5)


def test_sets_that_are_none_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"is no set of samples: manifest.json is missing"):
        BevSet.open(tmp_path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m: m["samples"][0].pop("cameras"), "missing required field `cameras`"),
        (lambda m: m.update(image={"height_px": 0, "width_px": 3, "cropped_px": 0}), "no size of a picture"),
        (lambda m: m["samples"][0].update(id="../out"), "out"),
        (lambda m: m["image"].update(width_px=66), "expected 66x24"),
    ],
)
def test_manifests_are_checked(written, change, said):
    path = written / "manifest.json"
    values = json.loads(path.read_text())
    change(values)
    path.write_text(json.dumps(values))
    with pytest.raises(InputError, match=said):
        BevSet.open(written)[0]


def test_damaged_labels_are_named(written):
    name = BevSet.open(written).notes[1].id
    (written / f"labels/{name}.npz").write_bytes(b"nothing")
    with pytest.raises(InputError, match=name):
        BevSet.open(written)[1]


def test_an_older_set_is_kept_unless_told(written, samples):
    with pytest.raises(InputError, match="exists already"):
        write_bev_set(samples, written, IMAGE, GRID, count=3)
    write_bev_set(samples[:1], written, IMAGE, GRID, count=1, replace=True)
    assert len(BevSet.open(written)) == 1
