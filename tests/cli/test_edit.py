"""``dreamdrive edit`` and ``dreamdrive actors``."""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import pytest

from dreamdrive import load_scene
from dreamdrive.scene.scene import Provenance
from dreamdrive.stored import save_scene
from tests.cli.conftest import Run
from tests.cli.test_commands import driving
from tests.scene.scenes import make_scene


@pytest.fixture
def out(tmp_path: Path) -> Path:
    save_scene(driving(make_scene(dynamic=9)), tmp_path / "out" / "scene")
    return tmp_path / "out"


def test_a_scene_is_edited_edited_again_and_taken_back(run: Run, out: Path, tmp_path: Path) -> None:
    one, two, three = (tmp_path / name for name in ("one", "two", "three"))
    result = run("edit", out, "--move", "0=0,2", "--copy", "0=3,0", "-o", one)
    assert result.code == 0, result
    assert result.out == f"the new one is actor 2 {one}"
    assert [actor.id for actor in load_scene(one / "scene").actors] == [0, 2]
    kinds = [each["kind"] for each in json.loads((one / "edits.json").read_text())["edits"]]
    assert kinds == ["move", "copy"]
    again = run("edit", out, "--edits", one / "edits.json", "--undo", 1, "--turn", "0=-20", "-o", two)
    assert again.code == 0, again
    assert [actor.id for actor in load_scene(two / "scene").actors] == [0]
    assert run("edit", one, "--remove", 2, "-o", three).code == 0
    assert "exists already" in run("edit", one, "--remove", 2, "-o", three).err
    assert run("edit", one, "--remove", 2, "-o", three, "--force").code == 0
    rendered = run("render", three, "--trajectory", "stop", "--fps", 5, "-o", tmp_path / "a.mp4")
    assert rendered.code == 0, rendered


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "there is nothing to change"),
        (("--move", "0"), "--move 0: expected ID=AHEAD,LEFT in metres, such as 3=0,2"),
        (("--move", "0=a,b"), "--move 0=a,b: expected ID=AHEAD,LEFT"),
        (("--turn", "x=3"), "--turn x=3: expected ID=NUMBER"),
        (("--recolour", "0=red"), "--recolour 0=red: expected ID=#RRGGBB"),
        (("--remove", "9"), "remove 9: no actor 9; there are 0"),
        (("--speed", "0=-1"), "speed -1: expected a factor above 0"),
        (("--insert", "b:1"), "--insert b:1: expected OTHER:ID@AHEAD,LEFT"),
        (("--insert", "nothere:1@3,0"), "nothere does not exist"),
        (("--undo", "1"), "--undo needs --edits FILE"),
        (("--edits", "none.json"), "--edits none.json does not exist; expected edits.json"),
    ],
)
def test_one_message_and_exit_2(
    run: Run, out: Path, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    result = run("edit", out, *words, "-o", tmp_path / "made")
    assert result.code == 2, result
    assert said in result.err
    assert not (tmp_path / "made").exists()


def test_an_actor_of_another_scene_is_set_in(run: Run, out: Path, tmp_path: Path) -> None:
    made = driving(make_scene(dynamic=9))
    road = replace(made, provenance=Provenance(up=(0.0, -1.0, 0.0), camera_height_m=1.5))
    for name in ("here", "there"):
        save_scene(road, tmp_path / name)
    here, one = tmp_path / "here", tmp_path / "one"
    result = run("edit", here, "--insert", f"{tmp_path / 'there'}:0@12,-3,0.5", "-o", one)
    assert result.code == 0, result
    assert result.out.startswith("the new one is actor 2")
    assert load_scene(tmp_path / "one" / "scene").actor(2).track.first_s == 0.5
    kept = json.loads((tmp_path / "one" / "edits.json").read_text())["edits"][0]
    assert (kept["kind"], kept["other"]) == ("insert", str(tmp_path / "there"))
    without = run("edit", out, "--insert", f"{tmp_path / 'there'}:0@12,0", "-o", tmp_path / "two")
    assert "does not know its road" in without.err
    assert not (tmp_path / "two").exists()


def test_edits_of_another_scene_are_refused(run: Run, out: Path, tmp_path: Path) -> None:
    assert run("edit", out, "--remove", 0, "-o", tmp_path / "one").code == 0
    other = run("edit", tmp_path / "one", "--edits", tmp_path / "one" / "edits.json", "-o", tmp_path / "two")
    assert "is of another scene" in other.err


def test_actors_are_listed_and_drawn(run: Run, out: Path, tmp_path: Path) -> None:
    result = run("actors", out, "-o", tmp_path / "a.png")
    assert result.code == 0, result
    assert "0 vehicle 4.4 1.8 1.5" in result.out
    assert result.out.endswith(str(tmp_path / "a.png"))
    picture = cv2.imread(str(tmp_path / "a.png"))
    assert picture is not None
    assert picture.shape == (160, 160, 3)
    assert "expected a name that ends in .png" in run("actors", out, "-o", tmp_path / "a.jpg").err
    run("edit", out, "--remove", 0, "-o", tmp_path / "bare")
    assert run("actors", tmp_path / "bare").out == "nothing in this scene moves on a track"
