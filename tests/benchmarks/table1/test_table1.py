"""The benchmark of Table I: what is compared with what, what is kept, and what the table says."""

import json
import shutil
from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.evaluate.clips.extractors import Extractor, Toolbox
from dreamdrive.options import QUALITIES
from dreamdrive.run.report.outcome import Outcome
from dreamdrive.scene.control import Control
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import save_scene
from dreamdrive_bench.table1 import case, drives, main as table1, scenes, tables
from dreamdrive_bench.table1.measure import Ruler, row_of
from tests.logs import log
from tests.scene.scenes import make_scene

FRAMES = 8


@pytest.fixture
def data(one_drive: Path, tmp_path: Path) -> Path:
    """A data set of one scene."""
    return shutil.copytree(one_drive, tmp_path / "set")


def mean_colour(frames: torch.Tensor) -> np.ndarray:
    return frames.double().mean(dim=(1, 2)).numpy()


def toolbox(*, real: bool = False) -> Toolbox:
    names = (("fid", "kid"), ("fvd", "kvd")) if real else ((n.frechet, n.kernel) for n in (IMAGE, VIDEO))
    box = Toolbox()
    for (frechet, kernel), window in zip(names, (False, True), strict=True):
        features = (lambda f: mean_colour(f).mean(axis=0)[None]) if window else mean_colour
        box.extractors.append(Extractor(frechet, kernel, window, features))
        box.weights[frechet] = {"file": f"{frechet}.pth", "sha256": "0"}
    return box


IMAGE, VIDEO = tables.IMAGE[1], tables.VIDEO[1]


def scene() -> Scene:
    made = make_scene()
    camera, poses = made.cameras[0].resized(32, 24), np.tile(np.eye(4), (FRAMES, 1, 1))
    poses[:, 2, 3] = 0.4 * np.arange(FRAMES)
    cameras = tuple(camera.at(pose) for pose in poses)
    return replace(made, cameras=cameras, times_s=0.2 * np.arange(FRAMES), held_out=np.zeros(FRAMES, bool))


def report_file() -> dict[str, Any]:
    return {
        "stages": {name: {"seconds": 1.0, "cached": name == "prior"} for name in ("prior", "fit")},
        "held_out_mean": {"psnr": 25.0, "ssim": 0.8},
        "held_out": {"1": {}},
        "baselines": {},
        "gaussians": {"static": 7, "dynamic": 4},
        "actors": [],
        "frames": {"size": [32, 24]},
        "steps": {"fit": 1},
        "rough": [],
    }


@pytest.fixture
def generated(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Representations in the order in which they are made; the scene of each is the same."""
    asked: list[str] = []

    def generate(control: Control, out: Path, **about: Any) -> Outcome:
        asked.append(about["options"].representation)
        out.mkdir(parents=True, exist_ok=True)
        save_scene(scene(), out / "scene", replace=True)
        (out / "report.json").write_text(json.dumps(report_file()))
        return Outcome(False, FRAMES, (32, 24), 7, 4, 0, {}, 1, 25.0, None, (), ())

    monkeypatch.setattr(scenes, "generate", generate)
    monkeypatch.setattr(table1, "toolbox_of", lambda *_: toolbox())
    return asked


def command(data: Path, tmp_path: Path, *more: str) -> list[str]:
    base = [str(data), "--frames", f"0:{FRAMES}", "--window", "3", "--stride", "1", "--hold-out", "4"]
    files = ["--runs", str(tmp_path / "runs"), "--json", str(tmp_path / "a.json")]
    return [*base, *files, "--representations", "static", "hybrid", *more]


def test_all_of_it_is_measured_and_taken_the_next_time(
    data: Path, tmp_path: Path, generated: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert table1.main(command(data, tmp_path)) == 0
    assert generated == ["static", "hybrid"]
    told = json.loads((tmp_path / "a.json").read_text())
    assert told["scenes"] == ["scene-0001"]
    assert told["asked"]["trajectories"] == ["shift-left", "shift-right", "lane-left"]
    novel = told["rows"]["hybrid"]["novel"][IMAGE.frechet]
    assert (novel["real_samples"], novel["fake_samples"]) == (FRAMES, 3 * FRAMES)
    windows = told["rows"]["hybrid"]["novel"][VIDEO.frechet]
    assert (windows["real_samples"], windows["fake_samples"]) == (6, 18)
    assert set(told["rows"]["hybrid"]["alone"]) == {*told["asked"]["trajectories"], "forward"}
    assert told["rows"]["hybrid"]["held_out"] == {"psnr": 25.0, "ssim": 0.8, "frames": 1}
    assert told["made"]["hybrid"]["scene-0001"]["taken_from_another"] == ["prior"]
    pictures = tmp_path / "runs/rendered/static/scene-0001-shift-left"
    assert len(list(pictures.glob("*.png"))) == FRAMES
    out = capsys.readouterr().out
    assert table1.main(command(data, tmp_path)) == 0
    assert generated == ["static", "hybrid"]
    assert out.splitlines()[2:] == capsys.readouterr().out.splitlines()[2:]


def test_what_follows_from_something_else_is_made_again(
    data: Path, tmp_path: Path, generated: list[str]
) -> None:
    few = ("--representations", "vibration", "--trajectories", "stop")
    table1.main(command(data, tmp_path, *few))
    table1.main(command(data, tmp_path, *few, "--quality", "standard"))
    assert generated == ["vibration"] * 2


def test_a_scene_that_fails_is_named_and_in_no_row(
    data: Path,
    tmp_path: Path,
    generated: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    usual = scenes.generate

    def generate(control: Control, out: Path, **about: Any) -> Outcome:
        if about["options"].representation == "hybrid":
            raise InputError("memory cannot hold the clip")
        return usual(control, out, **about)

    monkeypatch.setattr(scenes, "generate", generate)
    assert table1.main(command(data, tmp_path)) == 1
    said = capsys.readouterr()
    assert "No scene has all rows." in said.out
    assert "failed: scene-0001, hybrid: memory cannot hold the clip" in said.err


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (
            ["--trajectories", "sideways"],
            "--trajectories sideways: unknown; expected some of shift, shift-left",
        ),
        (["--trajectories", "forward"], "--trajectories forward: unknown"),
        (["--scenes", "7"], "--scenes 7: .* no such scene; expected a name, a number from 0 to 0, or all"),
        (["--scenes", "0", "scene-0001"], "a scene is named twice"),
        (["--shift-m", "0"], "--shift-m 0: expected metres above 0"),
        (["--stride", "0"], "--stride 0: expected 1 or more"),
        (["--window", "0"], "--window 0: expected 1 or more"),
        (["--resamples", "-1"], "--resamples -1: expected 0 or more"),
        (["--size", "wide"], "--size: wide: expected WIDTHxHEIGHT"),
        (["--prior", "dream"], "--prior dream: unknown"),
        (["--window", "8", "--i3d", "i3d.pt"], "--window 8: FVD needs 9 pictures or more"),
        (["--window", "6", "--stride", "2"], "2 real windows are too few for a floor"),
        (["--representations", "dynamic"], "invalid choice: 'dynamic'"),
    ],
)
def test_mistakes_are_told(
    data: Path,
    tmp_path: Path,
    generated: list[str],
    capsys: pytest.CaptureFixture[str],
    more: list[str],
    words: str,
) -> None:
    with pytest.raises(SystemExit, match="2"):
        table1.main(command(data, tmp_path, *more))
    with pytest.raises(InputError, match=words):
        raise InputError(capsys.readouterr().err)


def test_a_data_set_has_to_be_there_and_to_have_scenes(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist; expected a data set"):
        case.scene_names(tmp_path / "nothing", ["0"])
    with pytest.raises(InputError, match="a single recording; expected a data set with scenes"):
        case.scene_names(tmp_path, ["all"])


def test_weights_have_to_be_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--inception .*none.pth: no such file"):
        table1.toolbox_of(tmp_path / "none.pth", None)


def test_a_prior_that_looks_gets_the_first_recorded_picture(data: Path) -> None:
    recorded = Control(path=data, scene="scene-0001", frames="2:8", hold_out=4)
    replayed = case.Case(recorded, "replay", None, QUALITIES["draft"])
    assert replayed.control() == recorded
    assert case.Case(recorded, "street-world", None, QUALITIES["draft"]).control() == recorded
    looked = case.Case(recorded, "photo", None, QUALITIES["draft"]).control()
    first = log(data.parent / "again").cameras[0]
    assert looked.path is not None
    assert looked.path.name.split("__")[1] == "CAM_FRONT"
    assert looked.hfov_deg == pytest.approx(
        np.rad2deg(2 * np.arctan(first.pinhole.width_px / 2 / first.pinhole.fx_px))
    )
    assert (looked.scene, looked.frames, looked.hold_out) == (None, None, 4)
    assert len(replayed.real((32, 24))) == 6


def test_rows_share_all_options_but_the_representation(data: Path) -> None:
    one = case.Case(Control(path=data, scene="scene-0001"), "replay", None, QUALITIES["draft"])
    hybrid, standing, static = (one.request(row).options for row in ("hybrid", case.STANDING, "static"))
    assert standing == replace(hybrid, drift=replace(hybrid.drift, allowed=False))
    assert hybrid.drift.allowed
    assert static == replace(hybrid, representation="static")


def test_shift_is_both_sides_and_other_names_may_have_underscores() -> None:
    assert drives.chosen(["shift", "lane_left"]) == ["shift-left", "shift-right", "lane-left"]
    assert drives.chosen(["shift-right", "shift"]) == ["shift-right", "shift-left"]


def test_novel_trajectories_have_the_recorded_times() -> None:
    made = scene()
    left, right = (drives.trajectory(made, name, 1.5) for name in ("shift-left", "shift-right"))
    np.testing.assert_allclose(left.times_s, made.trajectory.times_s)
    recorded = made.trajectory.positions_m
    np.testing.assert_allclose(left.positions_m - recorded, np.tile([-1.5, 0, 0], (FRAMES, 1)), atol=1e-6)
    np.testing.assert_allclose(right.positions_m - recorded, np.tile([1.5, 0, 0], (FRAMES, 1)), atol=1e-6)


def features(shift: float, count: int = 20) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    return {name: rng.normal(size=(count, 2)) + shift for name in (IMAGE.frechet, VIDEO.frechet)}


@pytest.fixture
def report() -> dict[str, Any]:
    return deepcopy(_report())


@cache
def _report() -> dict[str, Any]:
    real = [features(0.0), features(0.5)]
    rows = {}
    for name, off in (("static", 3.0), ("vibration", 2.0), ("hybrid", 1.0)):
        fake = {"stop": [features(off), features(off)], "forward": real}
        rows[name] = row_of(real, fake, ["stop"], toolbox(), 10) | {
            "held_out": None,
            "drifting": int(name == "hybrid"),
        }
    asked = {"prior": "replay", "quality": "draft", "window": 16, "stride": 2, "shift_m": 2.0}
    return {
        "dataset": "set",
        "scenes": ["scene-0001", "scene-0002"],
        "asked": {**asked, "trajectories": ["stop"]},
        "size": [480, 270],
        "recorded_path": "forward",
        "weights": toolbox().weights,
        "rows": rows,
    }


def test_the_table_has_the_papers_figures_apart_and_says_what_stands_in(report: dict[str, Any]) -> None:
    text = tables.tables(report)
    assert "Of set 2 scenes, prior replay, draft, 480x270." in text
    assert "40 real and 40 rendered pictures and 40 real and 40 rendered windows of 16" in text
    assert "stand-in for FID's network: its figures cannot be compared" in text
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    assert "the paper's FID / FVD" in lines[0]
    static, vibration, hybrid = lines[2:5]
    assert static.endswith("| 3D-GS: 82.12 / 787.67 |")
    assert vibration.endswith("| - |")
    assert hybrid.startswith("| hybrid (street drifts in 1 of 2) |")
    assert hybrid.endswith("| DreamDrive: 45.59 / 374.02 |")
    assert "held-out" not in lines[0]
    values = [float(line.split("|")[2].split()[0]) for line in (static, vibration, hybrid)]
    assert values == sorted(values, reverse=True)
    assert all(" to " in line.split("|")[2] for line in (static, vibration, hybrid))
    assert sum("two halves of the real ones" in line for line in lines) == 2


def test_with_the_weights_the_figures_have_their_names(report: dict[str, Any]) -> None:
    told = report
    box = toolbox(real=True)
    for row in told["rows"].values():
        for found in (row["novel"], *row["alone"].values()):
            for old, new in zip((IMAGE, VIDEO), (tables.IMAGE[0], tables.VIDEO[0]), strict=True):
                found[new.frechet], found[new.kernel] = found[old.frechet], found[old.kernel]
    text = tables.tables(told | {"weights": told["weights"] | box.weights})
    assert "stand-in" not in text
    assert "FID is by Inception v3 (fid.pth). FVD is by I3D (fvd.pth)." in text
    assert "novel: FID" in text


def test_clips_shorter_than_a_window_are_refused(tmp_path: Path) -> None:
    pictures = drives.kept_real(np.zeros((3, 32, 32, 3), np.uint8), tmp_path / "real")
    with pytest.raises(InputError, match="has 3 pictures, fewer than --window 4"):
        Ruler(toolbox(), 4, 1).features(pictures, tmp_path / "features.json")


def test_real_pictures_are_kept_without_loss_and_without_older_ones(tmp_path: Path) -> None:
    frames = np.random.default_rng(0).integers(0, 256, (4, 32, 40, 3), dtype=np.uint8)
    drives.kept_real(frames, tmp_path / "real")
    assert (drives.kept_real(frames[:3], tmp_path / "real").read() == frames[:3]).all()


def test_means_of_withheld_frames_count_frames() -> None:
    records = [
        {"held_out": {"psnr": 20.0, "ssim": 0.5}, "held_out_frames": 1},
        {"held_out": {"psnr": 30.0, "ssim": 0.9}, "held_out_frames": 3},
        {"held_out": None, "held_out_frames": 0},
    ]
    assert table1.held_out(records) == {"psnr": 27.5, "ssim": pytest.approx(0.8), "frames": 4}
    assert table1.held_out(records[2:]) is None
