"""What the command line answers to common mistakes, word by word, as a text that is kept."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from dreamdrive import save_scene
from tests.cli.conftest import Run
from tests.conftest import ROOT
from tests.scene.scenes import make_scene
from tests.snapshot import agrees, part_agrees, parts_of

KEPT = ROOT / "tests/snapshots/messages.txt"
MISTAKES = """
generate none.mp4 -o out
generate notes.txt -o out
generate empty.mp4 -o out
generate nothing -o out
generate -o out
generate frames
generate frames -o frames
generate frames -o notes.txt
generate frames -o full
generate frames -o out --quality best
generate frames -o out --qualty draft
generate frames -o out --prior vsta
generate frames -o out --prior vista
generate frames -o out --prior street-world
generate frames -o out --geometry colmap
generate frames -o out --geometry dust3r
generate frames -o out --size wide
generate frames -o out --size 64x64
generate frames -o out --size 33x21
generate frames -o out --frames all
generate frames -o out --frames 0:9
generate frames -o out --fps -3
generate frames -o out --hold-out 1
generate frames -o out --camera-height 0
generate frames -o out --hfov 200
generate frames -o out --intrinsics none.json
generate frames -o out --intrinsics notes.txt
generate frames -o out --poses notes.txt
generate frames -o out --traffic flow
generate frames -o out --scene 0
generate frames -o out --knowledge none.safetensors
generate frames -o out --options notes.txt
generate frames -o out --options wrong.toml
generate frames -o out --weights none.pth
generate street.json -o out
render made
render none --trajectory shift
render full --trajectory shift
render made --trajectory sideways
render made --trajectory shift --size wide
render made --trajectory shift --without 7
export made --to obj -o made.obj
export made --to ply -o full
export none --to ply -o ply
plan made -o plan --trajectory sideways
look none.jpg -o seen
evaluate consistency none.mp4
data list none
dataset make none -o samples
nonsense
"""


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with inputs of all kinds, in which commands run, so that messages name no other place."""
    picture = np.random.default_rng(0).integers(0, 255, (40, 64, 3), np.uint8)
    for name in ("frames", "full", "nothing"):
        (tmp_path / name).mkdir()
    for i in range(4):
        cv2.imwrite(str(tmp_path / f"frames/{i}.png"), np.roll(picture, i, axis=1))
    for name, text in TEXTS.items():
        (tmp_path / name).write_text(text)
    save_scene(make_scene(), tmp_path / "made/scene")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "400")
    return tmp_path


TEXTS = {
    "empty.mp4": "",
    "notes.txt": "these are notes\n",
    "full/mine.txt": "mine",
    "wrong.toml": "[fit]\nstepps = 3\n",
    "street.json": '{"version": 1}',
}


@pytest.mark.parametrize("mistake", MISTAKES.split("\n")[1:-1])
def test_the_message_is_that_of_today(run: Run, place: Path, mistake: str) -> None:
    before = sorted(place.rglob("*"))
    result = run(*mistake.split())
    assert result.code == 2, result
    assert sorted(place.rglob("*")) == before
    part_agrees(KEPT, f"$ dreamdrive {mistake}", even(result.err))


def even(text: str) -> str:
    """A message without the frame around it, and with choices in the order of the alphabet."""
    text = re.sub(r" ?-{20,}", "", text)
    return re.sub(r"(?<=one of \()[^)]+", lambda names: ", ".join(sorted(names[0].split(", "))), text)


def test_no_message_is_kept_that_nobody_asks_for() -> None:
    asked = {f"$ dreamdrive {mistake}" for mistake in MISTAKES.split("\n")[1:-1]}
    kept = parts_of(KEPT)
    part = {title: text for title, text in kept.items() if title in asked}
    agrees(KEPT, "\n".join(f"{title}\n{text}\n" for title, text in part.items()))
