"""The benchmark of recorded clips: its camera paths, what counts as made, and what a failure leaves."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dreamdrive_bench import clips


def straight(metres: float) -> np.ndarray:
    poses = np.tile(np.eye(4), (8, 1, 1))
    poses[:, 2, 3] = np.linspace(0, metres, 8)
    return poses


def test_kitti_rows_give_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "clips" / "one"
    folder.mkdir(parents=True)
    np.savetxt(folder / "poses.txt", straight(70.0)[:, :3].reshape(8, 12))
    out = tmp_path / "out"
    out.mkdir()
    stages = {"fit": {"seconds": 2.0, "peak_rss_mb": 1.0}}
    empty = dict.fromkeys(("gaussians", "held_out_mean", "focal", "scale", "fallback", "detected"))
    frames = {"source_index": [0, 2, 4, 6]}
    report = {"stages": stages, "actors": [], "baselines": {}, "frames": frames, **empty}
    (out / "report.json").write_text(json.dumps(report))
    cameras = [SimpleNamespace(world_from_camera=pose) for pose in straight(7.0)[::2]]
    monkeypatch.setattr(clips, "DATA", tmp_path)
    monkeypatch.setattr(clips, "load_scene", lambda _: SimpleNamespace(cameras=cameras))
    monkeypatch.setattr(clips.subprocess, "run", lambda *_, **__: None)
    row = clips.measure("one", clips.Run("one", "frames", truth="kitti"), out)
    assert row["path_m"] == pytest.approx(60)
    assert row["path_error"] == pytest.approx(0, abs=1e-6)


def test_a_run_that_fails_is_named_and_the_others_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def measure(name: str, run: object, out: Path) -> dict[str, str]:
        if name == "udacity":
            raise subprocess.CalledProcessError(2, "generate")
        return {"name": name, "kept": str(out.exists())}

    (tmp_path / "runs" / "pandaset").mkdir(parents=True)
    monkeypatch.setattr(clips, "measure", measure)
    words = ["udacity", "pandaset", "--runs", str(tmp_path / "runs"), "--json", str(tmp_path / "of/all.json")]
    monkeypatch.setattr(sys, "argv", ["clips.py", *words, "--resume"])
    assert clips.main() == 1
    assert "failed: udacity" in capsys.readouterr().err
    rows = json.loads((tmp_path / "of/all.json").read_text())["rows"]
    assert rows == [{"name": "pandaset", "kept": "True"}]
    monkeypatch.setattr(sys, "argv", ["clips.py", *words[1:]])
    assert clips.main() == 0
    assert json.loads((tmp_path / "of/all.json").read_text())["rows"][0]["kept"] == "False"
