"""What the commands do with a scene."""

import re
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

from dreamdrive.data import write_trajectory
from dreamdrive.drive import MANOEUVRES
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.stored import save_scene
from tests.cli.conftest import Run
from tests.export.ply_file import columns, count
from tests.scene.scenes import make_baseline, make_scene


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """An output folder with a scene that drives 1 m ahead a frame."""
    save_scene(driving(make_scene()), tmp_path / "out" / "scene")
    return tmp_path / "out"


def driving(scene: Scene) -> Scene:
    """The scene seen from cameras that drive 1 m ahead a frame."""
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 2, 3] = np.arange(3) - 6
    cameras = tuple(c.at(pose) for c, pose in zip(scene.cameras, poses, strict=True))
    return replace(scene, cameras=cameras, provenance=Provenance())


def frames(path: Path) -> tuple[int, float]:
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.average_rate is not None
        return sum(1 for _ in container.decode(stream)), float(stream.average_rate)


@pytest.mark.parametrize("name", MANOEUVRES)
def test_each_manoeuvre_becomes_a_video(run: Run, out: Path, name: str) -> None:
    result = run("render", out, "--trajectory", name)
    assert result.code == 0, result
    assert frames(out / "video" / f"{name}.mp4") == (5, pytest.approx(20))
    assert re.search(r"5 frames in [\d.]+ s, [\d.]+ frames/s", result.out)


def test_a_trajectory_file_becomes_a_video(run: Run, out: Path, tmp_path: Path) -> None:
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, 2, 3] = -6
    write_trajectory(Trajectory(poses, np.arange(4) / 4), tmp_path / "mine.json")
    result = run("render", out, "--trajectory", tmp_path / "mine.json", "-o", tmp_path / "deep" / "mine.mp4")
    assert result.code == 0, result
    assert frames(tmp_path / "deep" / "mine.mp4") == (4, pytest.approx(4))


def test_a_scene_folder_itself_is_taken_too(run: Run, out: Path, tmp_path: Path) -> None:
    assert run("render", out / "scene", "--trajectory", "stop", "-o", tmp_path / "s.mp4").code == 0


def test_a_wrong_trajectory_or_name_is_refused(run: Run, out: Path, tmp_path: Path) -> None:
    result = run("render", out, "--trajectory", "backwards")
    assert result.code == 2
    assert "no such file; expected a file with a trajectory or one of forward, left" in result.err
    result = run("render", out, "--trajectory", "stop", "-o", tmp_path / "film.avi")
    assert result.code == 2
    assert "expected a name that ends in .mp4" in result.err
    (tmp_path / "file").write_text("mine")
    result = run("render", out, "--trajectory", "stop", "-o", tmp_path / "file" / "film.mp4")
    assert result.code == 2
    assert "cannot write" in result.err


def test_a_damaged_scene_is_refused(run: Run, out: Path) -> None:
    part = out / "scene" / "main-static.safetensors"
    part.write_bytes(part.read_bytes()[:-1])
    result = run("render", out, "--trajectory", "stop")
    assert result.code == 2
    assert "is damaged" in result.err


def test_export_writes_a_file_or_a_sequence(run: Run, out: Path, tmp_path: Path) -> None:
    assert run("export", out, "--to", "ply", "-o", tmp_path / "all.ply").code == 0
    assert count(tmp_path / "all.ply") == 11
    assert run("export", out, "--to", "ply", "-o", tmp_path / "sequence").code == 0
    assert count(tmp_path / "sequence" / "static.ply") == 7
    assert len(list((tmp_path / "sequence" / "frames").iterdir())) == 3


@pytest.mark.parametrize("kind", ["hexplane", "vibration"])
def test_scenes_that_move_otherwise_are_rendered_and_exported(run: Run, tmp_path: Path, kind: str) -> None:
    save_scene(driving(make_baseline(kind)), tmp_path / "out" / "scene")
    assert run("render", tmp_path / "out", "--trajectory", "forward").code == 0
    assert frames(tmp_path / "out" / "video" / "forward.mp4")[0] == 5
    assert run("export", tmp_path / "out", "--to", "ply", "-o", tmp_path / "sequence").code == 0
    first, last = (columns(tmp_path / "sequence" / "frames" / f"{i:04d}.ply") for i in (0, 2))
    assert len(first["x"]) == 4
    assert not np.allclose(first["x"], last["x"])


def test_the_doctor_says_what_is_there(run: Run) -> None:
    result = run("doctor")
    assert result.code == 0, result
    assert re.search(r"native core isa (baseline|avx2|avx512), threads \d+", result.out)
    assert "everything that generate needs is there" in result.out


def test_the_doctor_says_what_is_missing(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("dreamdrive.run", "dreamdrive.run.report.document"):
        monkeypatch.setattr(f"{module}.PACKAGES", ("torch", "not-installed-package"))
    monkeypatch.setattr("dreamdrive.cli.doctor.free_bytes", lambda: 500_000_000)
    result = run("doctor")
    assert result.code == 2
    assert "missing: less than 3 GB of memory is free" in result.out
    assert "2 things are missing" in result.err


def test_the_doctor_says_whether_a_gpu_can_be_used(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dreamdrive.splat.why_unusable", lambda: "there is no nvcc: install it")
    assert re.search(r"GPU\s+not needed; there is no nvcc: install it", run("doctor").out)
    monkeypatch.setattr("dreamdrive.splat.why_unusable", lambda: None)
    monkeypatch.setattr("dreamdrive.cli.doctor.free_bytes", lambda *device: 16 * 10**9)
    result = run("doctor")
    assert result.code == 0
    assert re.search(
        r"GPU\s+backend gsplat can be used; not needed; 16\.0 GB are free, for about 1\d\.\d", result.out
    )


@pytest.mark.parametrize("command", [(), ("generate",), ("render",), ("export",), ("doctor",)])
def test_help(run: Run, command: tuple[str, ...]) -> None:
    result = run(*command, "--help")
    assert result.code == 0
    assert "usage: dreamdrive" in result.out


def test_version_is_said(run: Run) -> None:
    assert re.fullmatch(r"dreamdrive \d+\.\d+\.\d+", run("--version").out)
