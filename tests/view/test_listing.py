"""The list of scenes."""

from pathlib import Path

from dreamdrive.stored import save_scene
from dreamdrive.view.listing import scenes_below
from tests.cli.test_commands import driving
from tests.scene.scenes import make_scene


def test_scenes_are_found_by_what_is_given_to_commands(tmp_path: Path) -> None:
    for name in ("b/run/scene", "a", "b/run/stages/fit/value", ".hidden/scene"):
        save_scene(driving(make_scene()), tmp_path / name)
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / "scene.json").write_text("[]")  # of nuScenes
    (tmp_path / "link").symlink_to(tmp_path / "a")
    found = scenes_below(tmp_path)
    assert [each.path.relative_to(tmp_path).as_posix() for each in found] == ["a", "b/run"]
    assert [(each.frames, each.actors) for each in found] == [(3, 1), (3, 1)]
    size = sum(each.stat().st_size for each in (tmp_path / "a").iterdir())
    assert found[0].bytes == size > 1000


def test_in_a_run_it_is_the_run(tmp_path: Path) -> None:
    save_scene(driving(make_scene()), tmp_path / "scene")
    assert [each.path for each in scenes_below(tmp_path)] == [tmp_path]
    assert [each.path for each in scenes_below(tmp_path / "scene")] == [tmp_path / "scene"]


def test_nothing_is_an_empty_list(tmp_path: Path) -> None:
    assert scenes_below(tmp_path) == []
