"""The perception experiment from a pack, in miniature: two streets, two arms, one step."""

import json
import shutil
from dataclasses import replace

import msgspec
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.tasks.perception import QUICK, BevSet
from dreamdrive_bench.common.keep import save
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.perception.making import make_sets, make_street
from dreamdrive_bench.perception.protocol import PROTOCOL, Places, read_protocol
from dreamdrive_bench.perception.trials import Trial
from dreamdrive_bench.training import perception
from dreamdrive_bench.training.limit import Limit
from dreamdrive_bench.training.packed import MOST_BYTES
from dreamdrive_bench.training.perception import PerceptionPlan, make_pack

CPU = torch.device("cpu")
LONGER = read_protocol(PROTOCOL.with_name("longer.json"))
TINY = msgspec.structs.replace(
    LONGER,
    streets=msgspec.structs.replace(LONGER.streets, training=1, validation=1, seconds=0.5),
    real=msgspec.structs.replace(LONGER.real, streets=1, key_frames=2),
    generated=msgspec.structs.replace(LONGER.generated, per_street=2, validation_streets=1),
    regime=msgspec.structs.replace(LONGER.regime, steps=1, batch=2),
    arms={"real": ["real"], "generated": ["real", "generated-of-real"], "warped": ["real", "warped"]},
    seeds=[5],
)


def test_only_what_the_arms_take_is_made():
    assert len(LONGER.used) == 20
    assert len(read_protocol().used) == 48
    assert LONGER.sets == ["real", "generated-of-real", "warped", "validation", "generated-validation"]


def test_what_is_not_there_is_not_packed(tmp_path):
    with pytest.raises(InputError, match="generated-of-real"):
        make_pack(tmp_path / "pack", tmp_path, LONGER)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Sets in which recorded samples stand for rendered ones: no scene is made here."""
    places = Places(tmp_path_factory.mktemp("perception"))
    for seed in (50000, 52000):
        make_street(seed, TINY, places)
    make_sets(TINY, places, QUICK, ["real", "validation"])
    shutil.copytree(places.set("real"), places.set("generated-of-real"))
    return places.runs


@pytest.mark.slow
def test_networks_are_trained_from_a_pack(runs, tmp_path):
    size, quality = make_pack(tmp_path / "pack", runs, TINY)
    assert (quality, size) == (None, (tmp_path / "pack").stat().st_size)
    assert 0 < size < MOST_BYTES / 100
    size, quality = make_pack(tmp_path / "pack", runs, TINY, size - 1)
    assert quality == 90
    path, out = tmp_path / "f.json", tmp_path / "out"
    shutil.copytree(runs / "streets", out / "streets")
    plan = PerceptionPlan(TINY)
    assert not perception.train(tmp_path / "pack", out, CPU, Limit(0.0), Figures(path, CPU), plan)
    assert json.loads(path.read_text())["trials"] == []
    assert perception.train(tmp_path / "pack", out, CPU, Limit(600.0), Figures(path, CPU), plan)
    told = json.loads(path.read_text())
    assert told["pack"]["webp"] == 90
    assert sorted(row["arm"] for row in told["trials"]) == ["generated", "real", "warped"]
    assert any("generated over real" in line for line in told["tables"])
    carried, made = (BevSet.open(Places(out).set(name)) for name in ("generated-of-real", "real"))
    assert (carried[0].pictures == made[0].pictures).all()  # both went the same way
    assert (made[0].pictures != BevSet.open(Places(runs).set("real"))[0].pictures).any()
    again = replace(plan, found=told)
    shutil.rmtree(out / "trials")
    assert perception.train(tmp_path / "pack", out, CPU, Limit(0.0), Figures(path, CPU), again)
    assert json.loads(path.read_text())["tables"] == told["tables"]
    other = replace(plan, found=told | {"pack": {"sha256": "0", "webp": 90}})
    with pytest.raises(InputError, match="another pack"):
        perception.train(tmp_path / "pack", out, CPU, Limit(0.0), Figures(path, CPU), other)


@pytest.mark.slow
def test_a_quality_is_found_that_fits_and_other_streets_are_refused(runs, tmp_path):
    whole, _ = make_pack(tmp_path / "pack", runs, TINY)
    size, quality = make_pack(tmp_path / "pack", runs, TINY, whole - 1)
    assert (size, quality) == ((tmp_path / "pack").stat().st_size, 90)
    with pytest.raises(InputError, match=r"expected 0\.005 at most"):
        make_pack(tmp_path / "pack", runs, TINY, 5000)
    figures = Figures(tmp_path / "f.json", CPU)
    with pytest.raises(InputError, match="other streets"):
        perception.train(
            tmp_path / "pack", tmp_path / "out", CPU, Limit(0.0), figures, PerceptionPlan(LONGER)
        )


def test_groups_are_kept_and_none_begins_that_would_not_end(tmp_path, monkeypatch):
    """On a GPU, here without one: networks of a group take 30 s, and 100 s are there."""
    begun: list[list[str]] = []
    spent = [0.0]

    def train_on_gpu(group, samples, said):
        begun.append([each.name for each in group])
        said(100, 4000)
        spent[0] += 30.0
        said(4000, 4000)
        for each in group:
            counts = {"thresholds": [0.5], "hits": [1], "false_alarms": [1], "misses": [each.seed]}
            row = {"arm": each.arm, "seed": each.seed, "samples": 1}
            save(each.result, "key", row | {"validation": {"s": {"vehicle": counts, "road": counts}}})

    monkeypatch.setattr(perception, "held_by_arm", lambda trials, device: {})
    monkeypatch.setattr(perception, "train_on_gpu", train_on_gpu)
    monkeypatch.setattr(perception, "tables", lambda rows, protocol: "")
    monkeypatch.setattr(Limit, "spent_s", property(lambda limit: spent[0]))
    trials = [Trial(arm, seed, tmp_path, LONGER) for seed in LONGER.seeds for arm in LONGER.arms]
    figures, plan = Figures(tmp_path / "f.json", CPU), PerceptionPlan(LONGER, side_by_side=4)
    perception._train(trials, torch.device("cuda"), Limit(100.0), figures, plan)
    assert [len(each) for each in begun] == [4, 4, 4]  # the last three would need 22.5 s of 10
    told = json.loads((tmp_path / "f.json").read_text())
    assert len(told["trials"]) == 12
    assert told["group 3"]["steps"] == 4000
    begun.clear()
    perception._train(trials, torch.device("cuda"), Limit(85.0), figures, plan)
    assert begun == []  # 90 s are spent
    spent[0] = 0.0
    perception._train(trials, torch.device("cuda"), Limit(50.0), figures, plan)
    assert [len(each) for each in begun] == [4]


def test_a_group_that_is_late_is_not_kept(tmp_path, monkeypatch):
    spent = [0.0]

    def train_on_gpu(group, samples, said):
        spent[0] = 11.0
        said(100, 4000)
        pytest.fail("it goes on when time is over")

    monkeypatch.setattr(perception, "held_by_arm", lambda trials, device: {})
    monkeypatch.setattr(perception, "train_on_gpu", train_on_gpu)
    monkeypatch.setattr(Limit, "spent_s", property(lambda limit: spent[0]))
    trials = [Trial("real", 5, tmp_path, LONGER)]
    figures = Figures(tmp_path / "f.json", CPU)
    perception._train(trials, torch.device("cuda"), Limit(10.0), figures, PerceptionPlan(LONGER))
    assert figures.values["group 1"]["steps"] == 100
    assert "trials" not in figures.values
