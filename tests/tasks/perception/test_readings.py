"""Batches, scores and the three readings, on tiny sets."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.tasks.perception import (
    BevGrid,
    BevSet,
    CrossViewTransformer,
    CvtTraining,
    Regime,
    Samples,
    ScheduleOptions,
    bev_counts,
    pooled,
    read_trials,
    samples_of_log,
    score,
    shuffled,
    write_bev_set,
)
from dreamdrive.tasks.perception.network.inputs import as_batch
from tests.logs import log
from tests.tasks.perception.streets import ON_STREET_TRUNK as TINY

REGIME = Regime(TINY, CvtTraining(schedule=ScheduleOptions(steps=2)), batch=2)


@pytest.fixture(scope="module")
def sets(tmp_path_factory):
    made = {}
    for name in ("one", "other"):
        folder = tmp_path_factory.mktemp(name)
        write_bev_set(
            samples_of_log(log(folder / "made", name), TINY.image, TINY.grid),
            folder / "set",
            TINY.image,
            TINY.grid,
            count=3,
        )
        made[name] = BevSet.open(folder / "set")
    return made


def test_batches_go_on_from_any_step(sets):
    samples = Samples(list(sets.values()))
    assert len(samples) == 6
    batches = shuffled(samples, 2, seed=3)
    whole = [batch for batch, _ in zip(batches(0), range(8), strict=False)]
    later = next(iter(batches(7)))
    torch.testing.assert_close(whole[7].pictures, later.pictures)
    assert not torch.equal(whole[0].pictures, whole[3].pictures)


def test_each_sample_comes_once_a_round(sets):
    samples = Samples(list(sets.values()))
    batches = shuffled(samples, 2, seed=0)
    first = torch.cat([b.pictures for b, _ in zip(batches(0), range(3), strict=False)])
    wanted = torch.cat([as_batch([samples[k]]).pictures for k in range(6)])
    sums = first.float().mean(dim=(1, 2, 3, 4)).sort().values
    torch.testing.assert_close(sums, wanted.float().mean(dim=(1, 2, 3, 4)).sort().values)


def test_too_few_samples_are_refused(sets):
    with pytest.raises(InputError, match="3 samples are fewer than a batch of 4"):
        shuffled(Samples([sets["one"]]), 4, seed=0)


def test_sets_of_two_sizes_are_refused(sets, tmp_path):
    grid = BevGrid(24, 24)
    write_bev_set(
        samples_of_log(log(tmp_path / "made"), TINY.image, grid), tmp_path / "set", TINY.image, grid, count=3
    )
    with pytest.raises(InputError, match="pictures or cells of several sizes"):
        Samples([sets["one"], BevSet.open(tmp_path / "set")])


def test_sets_of_two_rigs_are_refused(sets):
    one = sets["one"]
    twice = msgspec.structs.replace(one.notes[0], cameras=one.notes[0].cameras * 2)
    with pytest.raises(InputError, match=r"samples of 2 and of 4 cameras; expected one rig"):
        Samples([one, replace(one, notes=(twice,))])


@pytest.mark.parametrize("at_once", [1, 2, 8])
def test_scores_of_drives_add_up(sets, at_once):
    network = CrossViewTransformer(TINY).eval()
    samples = Samples(list(sets.values()))
    told = []
    found = score(network, samples, at_once=at_once, progress=lambda *each: told.append(each))
    assert told[-1] == (6, 6)
    assert set(found) == {"one", "other"}
    batch = as_batch([samples[k] for k in range(6)])
    with torch.no_grad():
        said = network(batch.pictures, batch.pixel_from_camera, batch.camera_from_ego)
    together = bev_counts(said, batch.truth)
    for name, counts in pooled(found).items():
        assert counts.samples == 6
        np.testing.assert_allclose(counts.hits, together[name].hits, atol=2)
        np.testing.assert_allclose(counts.misses, together[name].misses, atol=2)


@pytest.mark.parametrize(
    ("mode", "rows"),
    [
        ("augment", [("real", "validation"), ("real-and-synthetic", "validation")]),
        ("realism", [("real", "validation"), ("real", "synthetic")]),
        ("synthetic-train", [("real", "validation"), ("synthetic", "validation")]),
    ],
)
def test_readings(sets, tmp_path, mode, rows):
    one, other = [sets["one"]], [sets["other"]]
    trials = read_trials(mode, one, other, other, tmp_path, REGIME)
    assert [(t.trained_on, t.tested_on) for t in trials] == rows
    again = read_trials(mode, one, other, other, tmp_path, REGIME)  # trained networks are taken
    assert again == trials


def test_a_reading_that_is_stopped_has_no_rows(sets, tmp_path):
    one = [sets["one"]]
    assert read_trials("augment", one, one, one, tmp_path, REGIME, stop=lambda: True) is None
