"""The street network from a pack, in miniature: drawn, trained, stopped, gone on with, judged."""

import json
from dataclasses import replace

import pytest
import torch

from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.training import street
from dreamdrive_bench.training.limit import SAVING_S, Limit
from dreamdrive_bench.training.packed import MOST_BYTES, save_pack, unpack
from dreamdrive_bench.training.street import StreetPlan
from dreamdrive_train.street_network import DrawnOptions, LoaderOptions, StreetTraining, TrainingOptions
from tests.records import write_folder

CPU = torch.device("cpu")
PLAN = StreetPlan(
    streets=1,
    judged=range(1),
    tried=4,
    drawn=DrawnOptions(moments=1, views=2),
    options=TrainingOptions(
        low_precision=False, log_each=1, loader=LoaderOptions(batch=2, sizes=((64, 64), (96, 64)))
    ),
)


@pytest.fixture(scope="module")
def pack(tmp_path_factory):
    folder = tmp_path_factory.mktemp("street")
    write_folder(folder / "real", range(1_000_000, 1_000_003), kept_out=1)
    lines = (folder / "real/records.jsonl").read_text().replace('"drawn"', '"real"')
    (folder / "real/records.jsonl").write_text(lines)
    save_pack(folder / "pack", {"real": folder / "real"}, {})
    return folder / "pack"


@pytest.mark.slow
def test_a_training_is_stopped_by_its_limit_and_goes_on(pack, tmp_path):
    path = tmp_path / "f.json"
    plan = replace(PLAN, steps=4)
    late = Limit(1.0)  # in which streets are drawn, and one step is taken
    assert not street.train(pack, tmp_path / "out", CPU, late, Figures(path, CPU), plan)
    told = json.loads(path.read_text())
    assert told["training"]["steps"] == 1
    assert "time was over" in told["stopped"]
    assert told["drawn"]["streets"] == 1
    assert street.train(pack, tmp_path / "out", CPU, Limit(600.0), Figures(path, CPU), plan)
    told = json.loads(path.read_text())
    assert "drawn" not in told  # it learns from what it had
    assert told["training"]["steps"] == told["training"]["of"] == 4
    assert told["training"]["losses"]["loss"] != 0
    assert {"1", "2", "3"} <= set(told["training"]["judged"])
    for when in ("start", "end"):
        assert (told[when]["real"]["records"], told[when]["drawn"]["records"]) == (2, 2)
    assert told["start"]["real"]["depth_rel"] != told["end"]["real"]["depth_rel"]
    assert (tmp_path / "out/network/street.safetensors").is_file()


@pytest.mark.slow
def test_as_many_steps_are_taken_as_fit_unless_they_are_told(pack, tmp_path):
    unpack(pack, tmp_path)
    training = StreetTraining((tmp_path / "real",), tmp_path / "network", PLAN.options, init=PLAN.init)
    assert street._steps(training, CPU, Limit(SAVING_S + 60.0), PLAN) > 2
    assert street._steps(training, CPU, Limit(1.0), PLAN) == 1
    assert street._steps(training, CPU, Limit(1.0), replace(PLAN, steps=7)) == 7
    assert not training.out.exists()
    training.out.mkdir()
    (training.out / "checkpoint.json").write_text('{"options": {"steps": 9}}')
    assert street._steps(training, CPU, Limit(1.0), replace(PLAN, steps=7)) == 9


@pytest.mark.slow
@pytest.mark.skipif(not (DATA / "training").is_dir(), reason="the training pictures are not there")
def test_the_pack_may_be_carried(tmp_path):
    size, quality = street.make_pack(tmp_path / "pack")
    assert quality is None
    assert 5_000_000 < size == (tmp_path / "pack").stat().st_size <= MOST_BYTES
