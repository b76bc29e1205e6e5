"""What the page writes: each lies in its folder alone, and replaces nothing unasked."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.data import read_trajectory
from dreamdrive.edit import EDITS, Move, Remove, read_edits
from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Scene
from dreamdrive.show import RenderOptions
from dreamdrive.stored import load_scene, save_scene
from dreamdrive.view.saving import CancelledError, Desk
from tests.cli.test_commands import driving, frames
from tests.files.test_output import tree
from tests.scene.scenes import make_scene

LETTER = "Dear reader"


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    save_scene(driving(make_scene()), tmp_path / "scene")
    return load_scene(tmp_path / "scene")


@pytest.fixture
def desk(tmp_path: Path, scene: Scene) -> Desk:
    (tmp_path / "desk").mkdir()
    (tmp_path / "desk" / "letter.txt").write_text(LETTER)
    return Desk(tmp_path / "desk", tmp_path / "scene")


def listed(desk: Desk) -> list[str]:
    return sorted(each.name for each in desk.folder.iterdir())


def test_a_path_is_what_render_reads(desk: Desk, scene: Scene) -> None:
    place = desk.save_path(scene.trajectory, "mine", replace=False)
    assert place == desk.folder / "mine.json"
    found = read_trajectory(place)
    np.testing.assert_allclose(found.world_from_camera, scene.trajectory.world_from_camera)
    np.testing.assert_allclose(found.times_s, scene.trajectory.times_s)
    assert listed(desk) == ["letter.txt", "mine.json"]


def test_a_video_has_all_frames_and_tells_of_them(desk: Desk, scene: Scene) -> None:
    told: list[tuple[int, int]] = []
    place = desk.save_video(
        scene, scene.trajectory, "mine.mp4", False, RenderOptions(), lambda *done: told.append(done)
    )
    assert frames(place) == (3, pytest.approx(10))
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert listed(desk) == ["letter.txt", "mine.mp4"]


def test_a_cancelled_video_leaves_nothing_and_the_next_one_runs(desk: Desk, scene: Scene) -> None:
    with pytest.raises(CancelledError):
        desk.save_video(
            scene, scene.trajectory, "mine", False, RenderOptions(), lambda done, total: desk.cancel()
        )
    assert listed(desk) == ["letter.txt"]
    assert desk.save_video(scene, scene.trajectory, "mine", False, RenderOptions(), lambda *_: None).is_file()


def test_one_video_is_rendered_at_a_time(desk: Desk, scene: Scene) -> None:
    def again(done: int, total: int) -> None:
        with pytest.raises(InputError, match="a video is being rendered already"):
            desk.save_video(scene, scene.trajectory, "other", False, RenderOptions(), lambda *_: None)

    desk.save_video(scene, scene.trajectory, "mine", False, RenderOptions(), again)
    assert listed(desk) == ["letter.txt", "mine.mp4"]


def test_an_edited_scene_is_as_edit_writes_it(desk: Desk, scene: Scene) -> None:
    edits = (Move(0, 0.0, 1.0), Remove(0))
    place = desk.save_scene(scene, edits, "mine", replace=False)
    stored = read_edits(place / EDITS)
    assert stored.edits == edits
    assert stored.of == desk.digest
    assert load_scene(place / "scene").actors == ()
    with pytest.raises(InputError, match="no actor was changed"):
        desk.save_scene(scene, (), "other", replace=False)


@pytest.mark.parametrize("name", ["../mine", "a/b", "/etc/mine", "", "  ", ".hidden", "..", "a\0b", "a\\b"])
def test_names_lie_in_the_folder_alone(desk: Desk, scene: Scene, name: str) -> None:
    before = tree(desk.folder.parent)
    for save in (
        lambda: desk.save_path(scene.trajectory, name, True),
        lambda: desk.save_video(scene, scene.trajectory, name, True, RenderOptions(), lambda *_: None),
        lambda: desk.save_scene(scene, (Remove(0),), name, True),
    ):
        with pytest.raises(InputError):
            save()
    assert tree(desk.folder.parent) == before


def test_nothing_is_replaced_unasked(desk: Desk, scene: Scene) -> None:
    for name in ("mine.json", "mine.mp4"):
        (desk.folder / name).write_text(LETTER)
    assert desk.is_taken("mine", ".json")
    with pytest.raises(InputError, match="exists already"):
        desk.save_path(scene.trajectory, "mine", replace=False)
    with pytest.raises(InputError, match="exists already"):
        desk.save_video(scene, scene.trajectory, "mine", False, RenderOptions(), lambda *_: None)
    assert {(desk.folder / name).read_text() for name in ("mine.json", "mine.mp4")} == {LETTER}
    desk.save_path(scene.trajectory, "mine", replace=True)
    assert len(read_trajectory(desk.folder / "mine.json")) == 3


def test_a_folder_of_others_is_never_replaced(desk: Desk, scene: Scene) -> None:
    (desk.folder / "mine").mkdir()
    (desk.folder / "mine" / "letter.txt").write_text(LETTER)
    with pytest.raises(InputError, match="is not replaced"):
        desk.save_scene(scene, (Remove(0),), "mine", replace=True)
    shutil.rmtree(desk.folder / "mine")
    desk.save_scene(scene, (Remove(0),), "mine", replace=False)
    with pytest.raises(InputError, match="exists already"):
        desk.save_scene(scene, (Remove(0),), "mine", replace=False)
    desk.save_scene(scene, (Move(0, 1.0, 0.0),), "mine", replace=True)
    assert len(load_scene(desk.folder / "mine" / "scene").actors) == 1
    with pytest.raises(InputError, match="is the input itself"):
        Desk(desk.folder, desk.folder / "mine").save_scene(scene, (Remove(0),), "mine", replace=True)
