"""A run at work, as its folder grows."""

import shutil
from pathlib import Path

import pytest

from dreamdrive.run import STAGES
from dreamdrive.scene.scene import Scene
from dreamdrive.view.during import RunWatch, state_of

Seen = list[tuple[str, object]]


def watched(out: Path) -> tuple[RunWatch, Seen]:
    seen: Seen = []
    show = lambda scene: seen.append(("scene", scene))  # noqa: E731
    return RunWatch(out, show, lambda said, picture: seen.append((said, picture))), seen


def test_before_anything_is_there_it_waits(tmp_path: Path) -> None:
    watch, seen = watched(tmp_path / "later")
    assert not watch.look()
    assert not watch.look()
    assert seen == [("Nothing has ended yet: the frames are being read or drawn.", None)]


@pytest.mark.slow
def test_it_shows_more_as_stages_end(finished: Path, tmp_path: Path) -> None:
    out, stages = tmp_path / "run", tmp_path / "run" / "stages"
    stages.mkdir(parents=True)
    watch, seen = watched(out)
    for name in STAGES:
        shutil.copytree(finished / "stages" / name, stages / name)
        if name == "geometry":
            shutil.copy(finished / "stages" / "first.png", stages)
        assert not watch.look()
        assert not watch.look()
    assert [what for what, _ in seen] == [
        "prior has ended, look is at work (stage 2 of 8).",
        "look has ended, geometry is at work (stage 3 of 8).",
        "geometry has ended, initialise is at work (stage 4 of 8).",
        "initialise has ended, static is at work (stage 5 of 8).",
        *("scene", "scene"),
    ]
    assert seen[2][1] == stages / "first.png"
    static, fitted = seen[4][1], seen[5][1]
    assert isinstance(static, Scene)
    assert isinstance(fitted, Scene)
    assert len(static.cameras) == len(fitted.cameras) == 6
    assert static.actors == ()
    shutil.copytree(finished / "scene", out / "scene")
    shutil.copy(finished / "report.json", out)
    assert watch.look()
    assert seen[6][0] == "scene"
    assert state_of(out).said == "The scene is there."


@pytest.mark.slow
def test_a_stage_that_is_half_written_waits_for_the_next_look(finished: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    shutil.copytree(finished / "stages", out / "stages")
    shutil.rmtree(out / "stages" / "fit")
    whole = (out / "stages" / "static" / "result.safetensors").read_bytes()
    (out / "stages" / "static" / "result.safetensors").write_bytes(whole[:100])
    watch, seen = watched(out)
    assert not watch.look()
    assert seen == []
    (out / "stages" / "static" / "result.safetensors").write_bytes(whole)
    watch.look()
    assert [what for what, _ in seen] == ["scene"]
