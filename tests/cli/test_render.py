"""What ``render`` and ``export`` leave and say."""

import json
import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from dreamdrive.stored import save_scene
from tests.cli.conftest import Run
from tests.cli.test_commands import driving, frames
from tests.scene.scenes import make_scene
from tests.trust.test_trust import street as wall


@pytest.fixture
def out(tmp_path: Path) -> Path:
    save_scene(driving(make_scene()), tmp_path / "out" / "scene")
    return tmp_path / "out"


def names(folder: Path) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("[!.]*") if p.is_file())


def test_several_drives_in_one_call(run: Run, out: Path, tmp_path: Path) -> None:
    wanted = (
        "render",
        out,
        "--trajectory",
        "stop",
        "--trajectory",
        "shift",
        "--size",
        "64x40",
        "--fps",
        "10",
    )
    result = run(*wanted)
    assert result.code == 0, result
    assert re.findall(r"(\S+): 3 frames in", result.out) == [
        f"{out}/video/stop.mp4",
        f"{out}/video/shift.mp4",
    ]
    assert frames(out / "video" / "shift.mp4") == (3, pytest.approx(10))
    result = run(*wanted, "--format", "png", "--show", "depth", "-o", tmp_path / "all")
    assert result.code == 0, result
    each = ["0000.png", "0001.png", "0002.png", "render.json"]
    assert names(tmp_path / "all") == [f"{d}_depth/{f}" for d in ("shift", "stop") for f in each]
    picture = cv2.imread(str(tmp_path / "all" / "stop_depth" / "0000.png"), cv2.IMREAD_UNCHANGED)
    assert picture is not None
    assert (picture.dtype, picture.shape) == (np.uint16, (40, 64))


def test_results_in_the_folder_have_names_of_their_own(run: Run, out: Path) -> None:
    for options in ((), ("--show", "static"), ("--format", "npz"), ("--format", "png", "--show", "dynamic")):
        assert run("render", out, "--trajectory", "stop", "--fps", "5", *options).code == 0
    assert names(out / "video") == [
        "stop.mp4",
        "stop_dynamic/0000.png",
        "stop_dynamic/0001.png",
        "stop_dynamic/render.json",
        "stop_npz/0000.npz",
        "stop_npz/0001.npz",
        "stop_npz/render.json",
        "stop_static.mp4",
    ]
    assert json.loads((out / "video" / "stop_dynamic" / "render.json").read_text())["show"] == "dynamic"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--size", "99999x99999"),
            "--size 99999x99999: too large for H.264 video; expected 8192 pixels a side and 8.9 million in "
            "all at most, such as 3840x2160",
        ),
        (("--size", "33x24"), "--size 33x24: a video has even sides; choose 32x24, or --format png"),
        (("--size", "9" * 5000 + "x2"), "expected WIDTHxHEIGHT in pixels, such as 480x270"),
        (("--fps", "nan"), "--fps nan: expected 0.1 to 240 frames a second"),
        (("--fps", "0"), "--fps 0: expected 0.1 to 240 frames a second"),
        (("--shift-m", "nan"), "--shift-m nan: expected metres to the right, such as 2 or -2"),
    ],
)
def test_what_cannot_be_is_refused_before_a_scene_is_looked_for(
    run: Run, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    result = run("render", tmp_path / "none", "--trajectory", "shift", *options)
    assert result.code == 2
    assert result.err.endswith(message)


def test_without_a_trajectory_one_is_asked_for(run: Run, out: Path) -> None:
    result = run("render", out)
    assert result.code == 2
    assert result.err == (
        "error: render needs a drive: give --trajectory NAME|FILE, such as --trajectory shift"
    )


def test_nothing_is_written_where_the_scene_shows_nothing(run: Run, out: Path) -> None:
    result = run("render", out, "--trajectory", "stop", "--trajectory", "shift", "--shift-m", "500")
    assert result.code == 2
    assert result.err.startswith("error: --shift-m 500 goes 500 m from the recorded path and sees 0% of what")
    assert not (out / "video").exists()


def test_export_says_what_is_left_out(run: Run, out: Path, tmp_path: Path) -> None:
    said = run("export", out, "--to", "ply", "-o", tmp_path / "all.ply").out
    assert said == (
        f"{tmp_path}/all.ply PLY holds the scene at one time: "
        "no sky, no exposure of the recording, no motion."
    )
    said = run("export", out, "--to", "ply", "-o", tmp_path / "all").out
    assert said.endswith(
        f"{tmp_path}/all PLY holds the scene at single times: no sky, no exposure of the recording, no "
        "motion in between."
    )
    save_scene(driving(make_scene(dynamic=0, full=False)), tmp_path / "bare")
    said = run("export", tmp_path / "bare", "--to", "ply", "-o", tmp_path / "bare.ply").out
    assert said == f"{tmp_path}/bare.ply PLY holds the scene at one time."


def test_a_moving_thing_is_left_out(run: Run, out: Path) -> None:
    wanted = ("render", out, "--trajectory", "stop", "--fps", "5", "--show", "dynamic", "--format", "npz")
    assert run(*wanted, "-o", out.parent / "all").code == 0
    assert run(*wanted, "--without", "0", "-o", out.parent / "less").code == 0
    name = next(each for each in names(out.parent / "all") if each.endswith(".npz"))
    with np.load(out.parent / "all" / name) as whole, np.load(out.parent / "less" / name) as less:
        assert any(not np.array_equal(whole[key], less[key]) for key in whole.files)
    result = run(*wanted, "--without", "7", "-o", out.parent / "none")
    assert (result.code, "--without: no actor 7; there are 0" in result.err) == (2, True), result


def test_guesses_are_left_out(run: Run, tmp_path: Path) -> None:
    scene = driving(make_scene())
    guesses = replace(scene.static.without_features(), filled=torch.ones(len(scene.static), dtype=torch.bool))
    save_scene(scene.with_standing(guesses), tmp_path / "more" / "scene")
    save_scene(scene, tmp_path / "out" / "scene")
    wanted = ("--trajectory", "stop", "--fps", "5", "--show", "static", "--format", "npz")
    for name, words in {"more": (), "same": ("--no-completion",), "out": ()}.items():
        source = tmp_path / ("more" if name == "same" else name)
        assert run("render", source, *wanted, *words, "-o", tmp_path / f"{name}-views").code == 0
    file = next(each for each in names(tmp_path / "out-views") if each.endswith(".npz"))
    alpha = {}
    for name in ("more", "same", "out"):
        with np.load(tmp_path / f"{name}-views" / file) as view:
            alpha[name] = view["alpha"]
    assert np.array_equal(alpha["same"], alpha["out"])
    assert alpha["more"].mean() > alpha["out"].mean()


def test_pictures_of_colours_are_blurred(
    run: Run, out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dreamdrive.cli.render.blurring", lambda: lambda frame: np.full_like(frame, 77))
    words = ("--trajectory", "stop", "--fps", "5", "--blur", "-o", tmp_path / "blurred")
    assert run("render", out, *words, "--format", "png").code == 0
    picture = cv2.imread(str(tmp_path / "blurred" / "0000.png"))
    assert picture is not None
    assert (picture == 77).all()
    for wrong in (("--format", "npz"), ("--show", "depth", "--format", "png")):
        done = run("render", out, *words, *wrong)
        assert done.code == 2
        assert "--blur changes colours in pictures" in done.err


@pytest.mark.slow
def test_trust_is_told_of_drives_aside_and_keeps_them_near(run: Run, tmp_path: Path) -> None:
    save_scene(wall(), tmp_path / "scene")
    begin = ("render", tmp_path / "scene", "--fps", "5", "--format", "png", "-o", tmp_path / "made")
    straight = run(*begin, "--trajectory", "forward")
    assert straight.code == 0, straight
    assert "PSNR to expect" not in straight.out
    aside = run(*begin, "--trajectory", "shift", "--shift-m", "5")
    assert aside.code == 0, aside
    told = re.search(
        r"PSNR to expect: ([\d.]+) dB on the recorded drive, ([\d.]+) dB 2 m aside; 3 dB", aside.out
    )
    assert told is not None, aside.out
    assert float(told[1]) > float(told[2])
    asked = path_of(tmp_path / "made")
    bent = run(*begin, "--trajectory", "shift", "--shift-m", "5", "--stay-within-trust", "--show", "trust")
    assert bent.code == 0, bent
    assert np.abs(path_of(tmp_path / "made")[:, 0]).max() < np.abs(asked[:, 0]).max() - 0.5


def test_trust_needs_a_scene_that_was_compared_with_its_frames(run: Run, out: Path) -> None:
    result = run("render", out, "--trajectory", "stop", "--show", "trust")
    assert result.code == 2
    assert "off its frames" in result.err


def path_of(folder: Path) -> np.ndarray:
    note = json.loads((folder / "render.json").read_text())
    return np.array(note["world_from_camera"])[:, :3, 3]
