"""``dreamdrive world make``."""

import json
from pathlib import Path

import cv2
import pytest

from dreamdrive import load_scene
from dreamdrive.data.layout_file import write_layout
from dreamdrive.scene.street.truth import MOUNTS
from streetworld import draw_street
from tests.cli.conftest import Run
from tests.test_generate import shorten


def test_a_world_is_written_with_all_truth(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "w"
    result = run("world", "make", "--seed", 4, "--frames", 2, "--size", "96x64", "-o", out)
    assert result.code == 0, result
    assert "2 frames in" in result.out
    for name in ("frames", "instances", "semantics", "moving", "sky"):
        assert cv2.imread(str(out / name / "0001.png"), cv2.IMREAD_UNCHANGED).shape[:2] == (64, 96)
    names = {path.name for path in out.glob("[!.]*")}
    assert {
        "depth",
        "flow.npz",
        "cameras.json",
        "poses.json",
        "boxes.json",
        "layout.json",
        "layout.png",
    } <= names
    assert json.loads((out / "classes.json").read_text())["road"] == 1


def test_a_given_layout_is_drawn_by_all_cameras(run: Run, tmp_path: Path) -> None:
    write_layout(draw_street(1), tmp_path / "street.json")
    out = tmp_path / "w"
    made = ["world", "make", "--layout", tmp_path / "street.json", "--frames", 1, "--size", "64x48"]
    result = run(*made, "--cameras", "surround", "--one-ray", "-o", out)
    assert result.code == 0, result
    assert {mount for mount in MOUNTS if (out / mount / "frames" / "0000.png").is_file()} == set(MOUNTS)
    again = run(*made, "-o", out)
    assert again.code == 2
    assert "exists already" in again.err
    assert "front:" not in again.out  # before anything is drawn


def test_corrupted_frames_have_a_clean_truth(run: Run, tmp_path: Path) -> None:
    made = ["world", "make", "--seed", 4, "--frames", 2, "--size", "96x64", "--one-ray"]
    for name, options in (("clean", []), ("bad", ["--corrupt", "generated,flicker=1"])):
        result = run(*made, *options, "-o", tmp_path / name)
        assert result.code == 0, result
    clean, bad = tmp_path / "clean", tmp_path / "bad"
    first, second = (cv2.imread(str(folder / "frames" / "0001.png")) for folder in (clean, bad))
    assert (first != second).mean() > 0.5
    for name in ("depth/0001.npz", "flow.npz", "boxes.json", "poses.json", "layout.json", "moving/0001.png"):
        assert (clean / name).read_bytes() == (bad / name).read_bytes()
    meta = json.loads((bad / "cameras.json").read_text())
    assert meta["corruption"] == {
        "warp": 0.5,
        "shimmer": 0.5,
        "flicker": 1.0,
        "drift": 0.5,
        "far": 0.5,
        "seed": 4,
    }
    assert "corruption" not in json.loads((clean / "cameras.json").read_text())
    wrong = run(*made, "--corrupt", "rain=1", "-o", tmp_path / "wrong")
    assert wrong.code == 2
    assert "'rain=1': expected warp=STRENGTH" in wrong.err


def test_a_layout_of_too_many_boxes_is_told_before_it_is_drawn(run: Run, tmp_path: Path) -> None:
    write_layout(draw_street(1), tmp_path / "street.json")
    layout = json.loads((tmp_path / "street.json").read_text())
    layout["boxes"] = [{**layout["boxes"][0], "id": f"{i}"} for i in range(256)]
    (tmp_path / "street.json").write_text(json.dumps(layout))
    result = run("world", "make", "--layout", tmp_path / "street.json", "-o", tmp_path / "w")
    assert result.code == 2
    assert "$.boxes: 256 boxes" in result.err
    assert not (tmp_path / "w").exists()


def test_a_drive_beyond_what_a_street_holds_is_told(run: Run, tmp_path: Path) -> None:
    result = run("world", "make", "--frames", 700, "-o", tmp_path / "w")
    assert result.code == 2
    assert "at most 60 s" in result.err


def test_mistakes_are_told(run: Run, tmp_path: Path) -> None:
    for wrong in (["--frames", 0], ["--fps", "-1"], ["--size", "8x8"], ["--seed", "-3"]):
        result = run("world", "make", *wrong, "-o", tmp_path / "w")
        assert result.code == 2
        assert "expected at least one frame" in result.err
    for size in ("99999x99999", "32000x18000"):
        result = run("world", "make", "--size", size, "-o", tmp_path / "w")
        assert result.code == 2
        assert result.err == (
            f"error: --size {size}: too large for H.264 video; expected 8192 pixels a side and 8.9 million "
            "in all at most, such as 3840x2160"
        )
    (tmp_path / "bad.json").write_text('{"ego": {"track": 3}}')
    result = run("world", "make", "--layout", tmp_path / "bad.json", "-o", tmp_path / "w")
    assert result.code == 2
    assert "$.ego.track" in result.err


def test_a_world_that_memory_cannot_hold_is_refused_before_it_is_drawn(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("streetworld.cli.free_bytes", lambda: 1_000_000_000)
    result = run("world", "make", "--size", "4000x2000", "--frames", 100, "-o", tmp_path / "w")
    assert result.code == 2
    assert result.err == (
        "error: 100 frames of 4000x2000 need about 17.6 GB of memory with their truth, and 1.0 GB are free; "
        "give fewer --frames or a smaller --size"
    )


@pytest.mark.slow
def test_a_surround_world_becomes_one_scene(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shorten(monkeypatch)
    world, out = tmp_path / "world", tmp_path / "out"
    made = ["world", "make", "--seed", 4, "--frames", 6, "--size", "96x64", "--cameras", "surround"]
    assert run(*made, "--one-ray", "-o", world).code == 0
    given = ["--quality", "draft", "--fps", 10, "--size", "96x64", "--hold-out", 4]
    done = run("generate", world, *given, "-o", out)
    assert done.code == 0, done.err
    report = json.loads((out / "report.json").read_text())
    assert set(report["held_out"]) == {"2", *(f"2_camera{k}" for k in range(1, 6))}
    assert len(list((out / "held_out").iterdir())) == 6
    assert (out / "video" / "surround.mp4").is_file()
    scene = load_scene(out / "scene")
    assert (len(scene.cameras), len(scene.trajectory)) == (36, 6)
