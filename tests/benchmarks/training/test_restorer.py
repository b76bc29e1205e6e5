"""The restorer from a pack, in miniature: packed, trained, stopped, gone on with, judged."""

import json

import cv2
import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.restore import CHANNELS, load_restorer
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.training import restorer
from dreamdrive_bench.training.limit import SAVING_S, Limit, steps_that_fit
from dreamdrive_bench.training.packed import unpack
from dreamdrive_bench.training.restorer import RestorerPlan
from dreamdrive_train.pairs import PairTraining

CPU = torch.device("cpu")
PLAN = RestorerPlan(steps=4, options=PairTraining(batch=2, crop_px=64, warm=2))


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    """Pairs of smooth maps, whose view is darker than the truth."""
    folder, generator = tmp_path_factory.mktemp("pairs"), np.random.default_rng(0)
    for number in range(12):
        small = generator.integers(50, 255, (5, 6, CHANNELS + 4)).astype(np.uint8)
        planes = np.stack([cv2.resize(each, (96, 80)) for each in small.transpose(2, 0, 1)])
        planes[:3], planes[-1] = planes[CHANNELS : CHANNELS + 3] - 30, 255
        np.save(folder / f"street-{number}.npy", planes)
    return folder


@pytest.fixture(scope="module")
def pack(pairs, tmp_path_factory):
    path = tmp_path_factory.mktemp("pack") / "pack"
    restorer.make_pack(path, pairs)
    return path


def test_pairs_come_out_as_they_went_in(pack, pairs, tmp_path):
    unpack(pack, tmp_path)
    learned, judged = restorer._pairs(tmp_path)
    assert (len(learned), len(judged)) == (10, 2)
    for file in (*learned, *judged):
        there, was = (np.load(each).astype(int) for each in (file, pairs / file.name))
        assert there.shape == was.shape
        assert np.abs(there - was).mean() < 2
    with pytest.raises(InputError, match="no pairs are there"):
        restorer.make_pack(tmp_path / "none", tmp_path / "empty")


@pytest.mark.slow
def test_a_training_is_stopped_by_its_limit_and_goes_on(pack, tmp_path):
    path = tmp_path / "f.json"
    late = Limit(1.0)
    assert not restorer.train(pack, tmp_path / "out", CPU, late, Figures(path, CPU), PLAN)
    told = json.loads(path.read_text())
    assert told["training"]["steps"] == 1
    assert "time was over" in told["stopped"]
    assert restorer.train(pack, tmp_path / "out", CPU, Limit(600.0), Figures(path, CPU), PLAN)
    told = json.loads(path.read_text())
    assert told["training"]["steps"] == told["training"]["of"] == 4
    assert told["pairs"] == {"learned": 10, "judged": 2}
    # The view is 30 of 255 darker than the truth.
    assert told["start"]["as it is"] == pytest.approx(-20 * np.log10(30 / 255), abs=0.3)
    assert told["end"]["mended"] != told["start"]["as it is"]
    load_restorer(tmp_path / "out/network/restorer.safetensors")


def test_as_many_steps_are_taken_as_fit():
    # Slow at first, then two a second: 100 s are left for them.
    times_s = [0.0, 5.0, 10.0, 10.5, 11.0, 11.5]
    assert steps_that_fit(times_s, Limit(SAVING_S + 100.0)) == pytest.approx(170, abs=1)
    assert steps_that_fit(times_s, Limit(1.0)) == 1
