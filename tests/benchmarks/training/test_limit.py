"""How long a training may take, and what is told while it goes."""

import json
import time

import pytest
import torch

from dreamdrive_bench.gpu.figures import Figures
from dreamdrive_bench.training.limit import Limit, Pace


def test_a_limit_is_over_when_its_seconds_are_spent():
    limit = Limit(10.0, time.monotonic() - 12.0)
    assert limit.spent_s == pytest.approx(12.0, abs=0.5)
    assert limit.left_s == pytest.approx(-2.0, abs=0.5)
    assert Limit(10.0).left_s > 9


def test_how_fast_it_goes_is_on_disk_with_what_else_is_known(tmp_path, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    pace = Pace(Figures(tmp_path / "f.json", torch.device("cpu")), "net", lambda: {"loss": 0.5})

    def told():
        return json.loads((tmp_path / "f.json").read_text())["net"]

    pace(1, 100)
    assert told() == {"steps": 1, "of": 100, "steps_per_second": None, "loss": 0.5}
    now[0] += 2.0
    pace(9, 100)
    assert told()["steps"] == 1  # too early to tell again
    now[0] += 8.0
    pace(41, 100)
    assert told()["steps_per_second"] == 4.0
    now[0] += 1.0
    pace(100, 100)  # the last is always told
    assert told()["steps"] == 100
