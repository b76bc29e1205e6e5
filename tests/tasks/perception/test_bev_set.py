"""Samples on disk come back as they were."""

import json

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.tasks.perception import BevGrid, BevSet, ImageSize, samples_of_log, write_bev_set
from tests.logs import log

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
        (lambda m: m["image"].pop("cropped_px"), "missing required field `cropped_px`"),
        (lambda m: m["grid"].pop("rows"), "missing required field `rows`"),
        (lambda m: m["grid"].update(rows=40.5), r"Expected `int`, got `float` - at `\$.grid.rows`"),
        (lambda m: m["grid"].update(length_m=0), "has no cells"),
        (lambda m: m["samples"][1].update(cameras=[]), r"length >= 1 - at `\$.samples\[1\].cameras`"),
        (lambda m: m["samples"][0]["world_from_ego"][0].__setitem__(3, 1e300), "within 1e"),
        (lambda m: m["samples"][0]["cameras"][0].update(camera_from_ego=[[0] * 4] * 4), "not a rotation"),
        (lambda m: m["samples"][0]["cameras"][0].update(pixel_from_camera=[[0] * 3] * 3), "no focal length"),
        (lambda m: m["samples"][0]["cameras"][0].update(pixel_from_camera=[[1e300] * 3] * 3), "<= 10000000"),
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


@pytest.mark.parametrize(
    "arrays",
    [
        {"values": np.zeros((0, 8))},
        {"cells": np.zeros(0, int)},
        {"cells": np.array([-1]), "values": np.zeros((1, 8))},
        {"cells": np.array([1600]), "values": np.zeros((1, 8))},
        {"cells": np.array([1.0]), "values": np.zeros((1, 8))},
        {"cells": np.array([True]), "values": np.zeros((1, 8))},
        {"cells": np.array([1]), "values": np.full((1, 8), np.nan)},
        {"cells": np.array(1), "values": np.zeros((1, 8))},
    ],
)
def test_maps_of_other_cells_are_refused(written, arrays):
    read = BevSet.open(written)
    np.savez(written / f"labels/{read.notes[0].id}.npz", **arrays)
    with pytest.raises(InputError, match="holds no maps of 40x40 cells"):
        read[0]


def test_a_manifest_that_is_a_link_is_not_ours(written):
    (written / "manifest.json").rename(written / "other.json")
    (written / "manifest.json").symlink_to("other.json")
    with pytest.raises(InputError, match="it is a link"):
        BevSet.open(written)


def test_an_older_set_is_kept_unless_told(written, samples):
    with pytest.raises(InputError, match="exists already"):
        write_bev_set(samples, written, IMAGE, GRID, count=3)
    write_bev_set(samples[:1], written, IMAGE, GRID, count=1, replace=True)
    assert len(BevSet.open(written)) == 1
