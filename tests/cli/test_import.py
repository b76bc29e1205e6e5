from pathlib import Path

import pytest
import torch

from dreamdrive.export import write_ply
from dreamdrive.stored import load_scene
from tests.cli.conftest import Run
from tests.scene.scenes import gaussians


def test_an_imported_scene_is_a_scene(run: Run, tmp_path: Path) -> None:
    splats = gaussians(30, 1)
    splats.means[3, 0] = torch.nan
    write_ply(splats, tmp_path / "a.ply")
    said = run("import", tmp_path / "a.ply", "-o", tmp_path / "out")
    assert (said.code, said.out) == (
        0,
        f"{tmp_path}/out holds 29 Gaussians. "
        "1 of the file cannot be drawn (NaN, or far beyond bounds): left out. "
        "Its cameras are 24 views from around it: the file has none.",
    )
    assert len(load_scene(tmp_path / "out" / "scene").static) == 29
    assert run("import", tmp_path / "a.ply", "-o", tmp_path / "out").code == 2
    assert run("import", tmp_path / "a.ply", "-o", tmp_path / "out", "--up", "z", "--force").code == 0
    assert run("export", tmp_path / "out", "--to", "glb", "-o", tmp_path / "b.glb").code == 0


@pytest.mark.slow
def test_other_commands_take_it(run: Run, tmp_path: Path) -> None:
    write_ply(gaussians(30, 1), tmp_path / "a.ply")
    run("import", tmp_path / "a.ply", "-o", tmp_path / "out")
    for command in ("render OUT --trajectory stop -o OUT-video.mp4", "export OUT --to colmap -o OUT-colmap"):
        words = [word.replace("OUT", str(tmp_path / "out")) for word in command.split()]
        done = run(*words)
        assert done.code == 0, done.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("none.ply", "none.ply does not exist; expected a file of 3D Gaussians: .ply, .spz, .glb"),
        ("a.obj", "a.obj ends in '.obj'; expected .ply, .spz, .glb"),
        ("a.ply --cameras none", "--cameras none does not exist; expected a file with poses and times"),
    ],
)
def test_mistakes_are_told(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.obj").write_text("v 0 0 0")
    Path("a.ply").write_text("")
    done = run("import", *words.split(), "-o", tmp_path / "out")
    assert done.code == 2
    assert message in done.err
