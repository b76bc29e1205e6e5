"""The one call about a GPU: figures, schedule and pack, on a pretended device."""

import json
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive_bench.gpu import fits, pack, part, whole
from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.gpu.weights import random_value
from tests.fit.test_trial import standing_wall

CPU = torch.device("cpu")


def test_figures_are_on_disk_at_once_and_a_failure_is_noted(tmp_path, capsys):
    figures = Figures(tmp_path / "f.json", CPU)
    figures.put("vista", "step", {"seconds": 1.0})
    with figures.attempt("decoder"):
        raise RuntimeError("out of memory")
    figures.put("vista", "after", 2)
    told = json.loads((tmp_path / "f.json").read_text())
    assert told["vista"] == {"step": {"seconds": 1.0}, "after": 2}
    assert told["failed"]["decoder"][-1] == "RuntimeError: out of memory"


def test_times_are_of_the_first_run_and_of_those_after(tmp_path):
    calls = []
    told = Figures(tmp_path / "f.json", CPU).timed(lambda: calls.append(1), again=3)
    assert len(calls) == 4
    assert set(told) == {"first_s", "seconds"}


def test_random_weights_keep_what_goes_through_them():
    assert random_value("norm1.weight", (5,), CPU).tolist() == [1.0] * 5
    assert random_value("conv.bias", (5,), CPU).tolist() == [0.0] * 5
    assert float(random_value("conv.weight", (64, 400), CPU).std()) == pytest.approx(1 / 20, rel=0.05)


def test_a_part_is_stopped_at_its_limit_and_the_next_goes_on(tmp_path, monkeypatch, capsys):
    write = "import sys, json; json.dump({'a': 1}, open(sys.argv[sys.argv.index('--json') + 1], 'w'));"
    program = {"networks": f"{write} import time; time.sleep(60)", "kernels": f"{write} sys.exit('no nvcc')"}
    parts = (whole.Part("networks", 0.5, ()), whole.Part("kernels", 30, ()))
    monkeypatch.setattr(whole, "PARTS", parts)
    code = "import sys; programs = " + repr(program) + "; exec(programs[sys.argv[1]])"
    monkeypatch.setattr(whole, "PART", [sys.executable, "-c", code])
    out, begin = tmp_path / "gpu.json", time.monotonic()
    assert whole.run_all(out, None, minutes=1, pretend=True, core=False) == 1
    assert time.monotonic() - begin < 30
    told = json.loads(out.read_text())["parts"]
    assert told["networks"]["a"] == 1
    assert "were over" in told["networks"]["stopped"]
    assert told["kernels"]["said"] == ["no nvcc"]
    assert "failed: networks, kernels" in capsys.readouterr().out


def test_no_part_begins_when_the_time_is_over(tmp_path):
    out = tmp_path / "gpu.json"
    assert whole.run_all(out, None, minutes=0, pretend=True, core=False) == 1
    assert json.loads(out.read_text())["parts"]["networks"]["said"] == ["no time was left"]


@pytest.fixture(scope="module")
def packed(tmp_path_factory):
    """A pack of a wall at one size, and what it was made of."""
    folder = tmp_path_factory.mktemp("gpu") / "pack"
    clip, geometry = standing_wall()
    clip = replace(clip, held_out=np.arange(len(clip)) == 4)
    pack.save_pack(folder, [(clip, geometry)])
    return folder, clip, geometry


def test_a_pack_gives_back_what_it_was_made_of(packed):
    folder, clip, geometry = packed
    again, found = pack.load_pack(folder, clip.size)
    near = geometry.depth_m > 0
    assert np.array_equal(found.depth_m > 0, near)
    assert np.abs(found.depth_m[near] / geometry.depth_m[near] - 1).max() < 0.006
    assert np.abs(found.confidence - geometry.confidence).max() < 0.034
    for name in ("sky", "fixed_regions"):
        assert np.array_equal(getattr(found, name), getattr(geometry, name)), name
    assert np.array_equal(again.valid, clip.valid)
    assert np.array_equal(again.held_out, clip.held_out)
    assert np.abs(again.frames.astype(int) - clip.frames).mean() < 10
    assert len(found.cameras) == len(geometry.cameras)


def test_a_packed_clip_is_fitted_and_its_held_out_frames_are_judged(packed, tmp_path):
    figures = Figures(tmp_path / "f.json", CPU, pretended=True)
    fits.measure(figures, packed[0])
    assert "failed" not in figures.values
    (told,) = json.loads((tmp_path / "f.json").read_text())["fits"]
    assert told["size"] == pack.name_of(packed[1].size)
    assert {"initialise", "static", "fit"} <= set(told["stages_s"])
    assert told["seconds"] > 0
    assert told["psnr"] > 5


def test_rows_of_a_pretended_gpu_are_a_scene(tmp_path):
    figures = Figures(tmp_path / "f.json", CPU, pretended=True)
    part.run("steps", figures, None)
    assert figures.values["rows"] == [{"gaussians": 500, "views": 8}]


@pytest.mark.slow
def test_all_parts_of_a_pretended_gpu(packed, tmp_path):
    out = tmp_path / "gpu.json"
    assert whole.run_all(out, packed[0], minutes=20, pretend=True, core=False) == 0
    parts = json.loads(out.read_text())["parts"]
    assert set(parts) == {"networks", "kernels", "fits", "two_cores", "steps", "generate", "profile"}
    networks = parts["networks"]
    assert {"vista", "svd", "magicdrive", "magicdrive-t", "dust3r"} <= set(networks)
    assert networks["vista"]["finite"]
    assert "2 frames at once, float32" in networks["vista"]["decoder"]
    assert parts["generate"]["finite"]
    assert parts["generate"]["frames"] == [6, 64, 64, 3]
    assert {"static", "fit"} <= set(parts["profile"])
