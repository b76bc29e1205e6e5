"""From a layout to a scene by MagicDrive, with the smallest network there can be."""

import json
from pathlib import Path

import pytest

from dreamdrive import load_scene
from dreamdrive.data.layout_file import write_layout
from streetworld import draw_street
from tests.cli.conftest import Run
from tests.prior.magicdrive.tiny import write_folder
from tests.test_generate import shorten


@pytest.mark.slow
@pytest.mark.parametrize(("prior", "frames"), [("magicdrive", "0:4"), ("magicdrive-t", "0:16:5")])
def test_six_generated_cameras_become_one_scene(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, prior: str, frames: str
) -> None:
    """The frames are noise; what counts is that the report says what they are, and that nothing stops."""
    shorten(monkeypatch)
    layout, out = tmp_path / "street.json", tmp_path / "out"
    write_layout(draw_street(3), layout)
    weights = write_folder(tmp_path / "weights", temporal=prior == "magicdrive-t").path
    given = ["--weights", weights, "--frames", frames, "--steps", 1, "--quality", "draft"]
    done = run("generate", layout, "--prior", prior, *given, "-o", out)
    assert done.code == 0, done.err
    report = json.loads((out / "report.json").read_text())
    assert any("generated from the layout" in note for note in report["notes"])
    assert report["requested"]["length_m"] > 0
    assert ("reason" in report["requested"]) == (prior == "magicdrive")
    assert (report["scale"]["source"] == "the path asked for") == (prior == "magicdrive")
    scene = load_scene(out / "scene")
    assert (len(scene.cameras), len(scene.trajectory)) == (24, 4)
    assert (out / "video" / "surround.mp4").is_file()
