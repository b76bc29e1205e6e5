"""Each mistake gives one message and exit code 2, and loses nothing that was there."""

import json
import os
import signal
import time
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive.run import production
from tests.cli.conftest import Run

GENERATE = import_module("dreamdrive.generate")


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    folder = tmp_path / "clip"
    folder.mkdir()
    rng = np.random.default_rng(0)
    picture = rng.integers(0, 255, (40, 64, 3), np.uint8)
    for i in range(4):
        cv2.imwrite(str(folder / f"{i}.png"), np.roll(picture, i, axis=1))
    return folder


def calibration(path: Path, **changes: object) -> Path:
    values = {
        "width": 64,
        "height": 40,
        "intrinsics": {"fx": 60, "fy": 60, "cx": 31.5, "cy": 19.5},
        **changes,
    }
    path.write_text(json.dumps(values))
    return path


def poses(path: Path, matrices: list[np.ndarray]) -> Path:
    times = [0.1 * i for i in range(len(matrices))]
    values = {"world_from_camera": [m.tolist() for m in matrices], "times_s": times}
    path.write_text(json.dumps(values))
    return path


def expect(run: Run, out: Path, *arguments: object, message: str) -> None:
    before = sorted(out.rglob("*")) if out.exists() else None
    result = run("generate", *arguments, "-o", out)
    assert result.code == 2, result
    assert message in result.err, result.err
    assert result.err.startswith("error: ")
    assert (sorted(out.rglob("*")) if out.exists() else None) == before


@pytest.mark.parametrize("name", ["static", "deformable", "hexplane", "vibration", "hybrid"])
def test_representations_are_known_by_name(run: Run, tmp_path: Path, name: str) -> None:
    missing = tmp_path / "none.mp4"
    expect(run, tmp_path / "out", missing, "--representation", name, message=f"{missing} does not exist")


def test_a_gpu_that_is_not_there_is_said_before_any_work(
    run: Run, tmp_path: Path, clip: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        GENERATE,
        "why_unusable",
        lambda: "gsplat is not installed: pip install it",
    )
    said = "error: --device cuda: gsplat is not installed: pip install it, or leave --device out for the CPU"
    expect(run, tmp_path / "out", clip, "--device", "cuda", message=said)


def test_a_representation_of_another_name_is_refused(run: Run, tmp_path: Path) -> None:
    result = run("generate", tmp_path / "none.mp4", "-o", tmp_path / "out", "--representation", "mesh")
    assert result.code == 2
    assert "hexplane" in result.err


def test_inputs_that_are_no_clip(run: Run, tmp_path: Path) -> None:
    out, file = tmp_path / "out", tmp_path / "clip.mp4"
    expect(run, out, file, message="does not exist; expected a video or a folder of images")
    file.write_bytes(b"")
    expect(run, out, file, message="empty")
    file.write_text("this is text\n" * 100)
    expect(run, out, file, message=str(file))
    (tmp_path / "nothing").mkdir()
    expect(run, out, tmp_path / "nothing", message="holds no images")
    expect(run, out, message="needs an input")


def test_a_picture_that_shows_nothing_or_has_weights_is_refused(run: Run, tmp_path: Path) -> None:
    photo = tmp_path / "photo.png"
    cv2.imwrite(str(photo), np.zeros((40, 64, 3), np.uint8))
    expect(run, tmp_path / "out", photo, message="of one colour")
    (tmp_path / "weights").mkdir()
    expect(
        run,
        tmp_path / "out",
        *(photo, "--weights", tmp_path / "weights"),
        message=f"error: {photo} is a photo: name the video model of --weights with --prior NAME, such as "
        "--prior vista",
    )


def test_options_that_cannot_be(run: Run, clip: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    expect(run, out, clip, "--size", "wide", message="expected WIDTHxHEIGHT in pixels, such as 480x270")
    expect(run, out, clip, "--size", "64x64", message="the nearest sizes are")
    expect(run, out, clip, "--size", "33x21", message="even")
    expect(run, out, clip, "--frames", "4:2", message="--frames 4:2")
    expect(run, out, clip, "--frames", "0:9", message="only 4 frames")
    expect(run, out, clip, "--frames", "all", message="expected START:STOP")
    expect(run, out, clip, "--hold-out", "1", message="--hold-out 1: expected 2 or more")
    expect(run, out, clip, "--hold-out", "64", message="withholds nothing")
    expect(run, out, clip, "--fps", "-3", message="--fps -3")
    expect(run, out, clip, "--camera-height", "0", message="--camera-height")
    expect(run, out, clip, "--prior", "street-world", message="expected a layout as JSON")


def test_a_clip_that_memory_cannot_hold_is_refused_before_it_is_read(
    run: Run, clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(production, "free_bytes", lambda: 700_000_000)
    expect(
        run,
        tmp_path / "out",
        *(clip, "--size", "3200x2000"),
        message="error: 4 frames at 3200x2000 need about 5.8 GB of memory, and 0.7 GB are free; give "
        "--size 346x216",
    )


def test_frames_that_do_not_fit_together(run: Run, clip: Path, tmp_path: Path) -> None:
    cv2.imwrite(str(clip / "2.png"), np.zeros((30, 64, 3), np.uint8))
    expect(run, tmp_path / "out", clip, message="expected frames of one size")
    (clip / "2.png").write_bytes((clip / "1.png").read_bytes()[:300])
    expect(run, tmp_path / "out", clip, message="cut short")


def test_calibration_and_poses_that_cannot_be_used(run: Run, clip: Path, tmp_path: Path) -> None:
    out, file = tmp_path / "out", tmp_path / "file.json"
    expect(run, out, clip, "--intrinsics", file, message="does not exist; expected a calibration file")
    expect(run, out, clip, "--intrinsics", calibration(file, width=128), message="128x40")
    expect(run, out, clip, "--intrinsics", calibration(file), "--hfov", "60", message="give one of them")
    expect(run, out, clip, "--poses", poses(file, [np.eye(4) * np.nan] * 4), message="NaN")
    expect(run, out, clip, "--poses", poses(file, [np.diag([1, 2, 1, 1.0])] * 4), message="rotation")
    file.write_text("{not json")
    expect(run, out, clip, "--poses", file, message=str(file))


def test_geometry_files_that_are_not_there(run: Run, clip: Path, tmp_path: Path) -> None:
    expect(
        run,
        tmp_path / "out",
        *(clip, "--geometry-files", tmp_path / "none"),
        message="--geometry-files " + str(tmp_path / "none"),
    )


@pytest.mark.parametrize("force", [(), ("--force",)])
def test_an_output_that_is_the_input(run: Run, clip: Path, force: tuple[str, ...]) -> None:
    expect(run, clip, clip, *force, message="is the input itself")


@pytest.mark.parametrize("place", ["file", "file/below/it"])
def test_an_output_below_a_file(run: Run, clip: Path, tmp_path: Path, place: str) -> None:
    (tmp_path / "file").write_text("mine")
    result = run("generate", clip, "-o", tmp_path / place)
    assert result.code == 2
    assert "a folder is needed there" in result.err
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_an_output_without_permission(run: Run, clip: Path, tmp_path: Path) -> None:
    (tmp_path / "locked").mkdir(mode=0o500)
    expect(run, tmp_path / "locked" / "out", clip, message="no permission to write")


def test_an_output_with_foreign_files(run: Run, clip: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("mine")
    expect(run, tmp_path / "out", clip, message="not dreamdrive's (thesis.tex)")
    (tmp_path / "out" / "thesis.tex").rename(tmp_path / "out" / "report.json")
    expect(run, tmp_path / "out", clip, "--force", message="which dreamdrive did not write")


def test_a_full_disk(run: Run, clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    result = run("generate", clip, "-o", tmp_path / "out", "--quality", "draft", "--knowledge", "none")
    assert result.code == 2
    assert "No space left on device" in result.err
    assert "free some space" in result.err


def test_a_refusal_by_the_system_is_worded(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> bool:
        raise OSError(122, "Disk quota exceeded", "/somewhere")

    monkeypatch.setattr(GENERATE, "generate", refused)
    result = run("generate", "--prior", "street-world", "-o", tmp_path / "out")
    assert result.code == 2
    assert result.err == (
        "error: Disk quota exceeded (/somewhere); free some of your quota, or choose a folder on another disk"
    )


def test_an_interruption_says_how_to_go_on(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> bool:
        raise KeyboardInterrupt

    monkeypatch.setattr(GENERATE, "generate", interrupted)
    result = run("generate", "--prior", "street-world", "-o", tmp_path / "out")
    assert result.code == 130
    assert "the same command goes on from there" in result.err


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_what_swallows_an_interruption_does_not_hide_it(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, code: int
) -> None:
    """As compiled libraries do, which then fail in another way."""

    def swallowing(*_: object, **__: object) -> bool:
        with suppress(KeyboardInterrupt):
            os.kill(os.getpid(), number)
        raise ValueError("could not determine the shape")

    monkeypatch.setattr(GENERATE, "generate", swallowing)
    result = run("generate", "--prior", "street-world", "-o", tmp_path / "out")
    assert result.code == code
    assert "the same command goes on from there" in result.err
    monkeypatch.setattr(GENERATE, "generate", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        run("generate", "--prior", "street-world", "-o", tmp_path / "out")


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_an_interruption_where_nothing_can_be_raised_is_raised_later(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, code: int
) -> None:
    """Python prints it there, as when an object is freed, and goes on."""

    class Freed:
        def __del__(self) -> None:
            os.kill(os.getpid(), number)

    def freeing(*_: object, **__: object) -> bool:
        held = [Freed()]
        held.clear()
        time.sleep(2)
        return True

    monkeypatch.setattr(GENERATE, "generate", freeing)
    result = run("generate", "--prior", "street-world", "-o", tmp_path / "out")
    assert result.code == code
    assert "the same command goes on from there" in result.err


def test_wrong_arguments(run: Run) -> None:
    for arguments in (
        (),
        ("generate",),
        ("generate", "clip", "-o", "out", "--quality", "best"),
        ("generate", "clip", "-o", "out", "--seed", "x"),
        ("render", "out"),
        ("export", "out", "--to", "obj", "-o", "x"),
        ("nonsense",),
    ):
        assert run(*arguments).code == 2


def test_commands_on_what_is_no_scene(run: Run, tmp_path: Path) -> None:
    for command in (
        ("render", tmp_path / "none", "--trajectory", "forward"),
        ("export", tmp_path / "none", "--to", "ply", "-o", tmp_path / "x.ply"),
    ):
        result = run(*command)
        assert result.code == 2
        assert "does not exist; expected the folder that dreamdrive generate wrote" in result.err
    (tmp_path / "half" / "stages").mkdir(parents=True)
    result = run("render", tmp_path / "half", "--trajectory", "forward")
    assert result.code == 2
    assert "it is unfinished: run the same generate command again" in result.err
