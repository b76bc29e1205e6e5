"""An output folder is only written to when that loses nothing."""

import json
import os
from pathlib import Path

import pytest

from dreamdrive.errors import InputError
from dreamdrive.run.workspace import Workspace, open_workspace

OPTIONS = {"quality": "draft", "size": (64, 40)}
REQUEST = {"digests": {"input": "abc"}, "options": OPTIONS, "seed": 0}
OTHER = {**REQUEST, "options": {**OPTIONS, "quality": "high"}}


def publish(out: Path, request: dict[str, object], files: dict[str, str]) -> None:
    workspace = Workspace(out, request)
    staging = workspace.fresh_staging()
    for name, text in files.items():
        (staging / name).parent.mkdir(parents=True, exist_ok=True)
        (staging / name).write_text(text)
    workspace.publish({"version": "0"})


def texts(out: Path) -> dict[str, str]:
    names = (p for p in out.rglob("*") if p.is_file() and "stages" not in p.parts and p.name != "report.json")
    return {p.relative_to(out).as_posix(): p.read_text() for p in names}


def test_a_new_folder_is_made_only_when_claimed(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    workspace = open_workspace(out, REQUEST)
    assert workspace is not None
    assert not out.exists()
    workspace.claim()
    noted = json.loads((out / "stages" / "request.json").read_text())["request"]
    assert noted == json.loads(json.dumps(REQUEST))


def test_an_empty_folder_is_fine(tmp_path: Path) -> None:
    assert open_workspace(tmp_path, REQUEST) is not None


def test_unfinished_work_of_the_same_request_goes_on(tmp_path: Path) -> None:
    Workspace(tmp_path, REQUEST).claim()
    assert open_workspace(tmp_path, REQUEST) is not None


def test_a_finished_result_needs_nothing(tmp_path: Path) -> None:
    publish(tmp_path, REQUEST, {"scene/scene.json": "a"})
    assert open_workspace(tmp_path, REQUEST) is None
    assert open_workspace(tmp_path, REQUEST, recompute=True) is not None
    assert open_workspace(tmp_path, REQUEST, force=True) is not None


def test_a_finished_result_with_a_missing_file_is_made_whole(tmp_path: Path) -> None:
    publish(tmp_path, REQUEST, {"scene/scene.json": "a"})
    (tmp_path / "scene" / "scene.json").unlink()
    assert open_workspace(tmp_path, REQUEST) is not None


@pytest.mark.parametrize("finished", [True, False])
def test_work_of_another_request_is_refused_without_force(tmp_path: Path, finished: bool) -> None:
    if finished:
        publish(tmp_path, REQUEST, {"scene/scene.json": "a"})
    else:
        Workspace(tmp_path, REQUEST).claim()
    with pytest.raises(InputError, match=r"made from another input .* \(quality differs\).*--force"):
        open_workspace(tmp_path, OTHER)
    assert open_workspace(tmp_path, OTHER, force=True) is not None


def test_foreign_files_are_refused_without_force(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(InputError, match=r"not dreamdrive's \(thesis.tex\)"):
        open_workspace(tmp_path, REQUEST)
    assert open_workspace(tmp_path, REQUEST, force=True) is not None


@pytest.mark.parametrize("force", [True, False])
@pytest.mark.parametrize("name", ["report.json", "scene", "video", "stages"])
def test_foreign_files_with_our_names_are_never_replaced(tmp_path: Path, name: str, force: bool) -> None:
    if name.endswith(".json"):
        (tmp_path / name).write_text('{"mine": true}')
    else:
        (tmp_path / name).mkdir()
        (tmp_path / name / "holiday.mp4").write_text("mine")
    with pytest.raises(InputError, match=f"{name}, which dreamdrive did not write"):
        open_workspace(tmp_path, REQUEST, force=force)


def test_force_keeps_foreign_files_and_removes_only_our_old_ones(tmp_path: Path) -> None:
    publish(tmp_path, REQUEST, {"scene/scene.json": "a", "held_out/0012.png": "a", "video/drive.mp4": "a"})
    (tmp_path / "thesis.tex").write_text("mine")
    (tmp_path / "video" / "holiday.mp4").write_text("mine")
    publish(tmp_path, OTHER, {"scene/scene.json": "b", "video/drive.mp4": "b"})
    assert texts(tmp_path) == {
        "scene/scene.json": "b",
        "video/drive.mp4": "b",
        "video/holiday.mp4": "mine",
        "thesis.tex": "mine",
    }


def test_the_old_result_stays_until_the_new_one_is_complete(tmp_path: Path) -> None:
    publish(tmp_path, REQUEST, {"scene/scene.json": "a"})
    workspace = open_workspace(tmp_path, OTHER, force=True)
    assert workspace is not None
    (workspace.fresh_staging() / "half").write_text("b")
    assert texts(tmp_path) == {"scene/scene.json": "a"}
    assert open_workspace(tmp_path, REQUEST) is None


def test_a_kill_while_publishing_is_not_taken_for_a_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish(tmp_path, REQUEST, {"scene/scene.json": "a", "held_out/0012.png": "a"})
    files = {"scene/scene.json": "b", "video/drive.mp4": "b"}
    replace = Path.replace

    def killed(self: Path, target: Path) -> Path:
        if self.name == "drive.mp4":
            raise KeyboardInterrupt
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", killed)
    with pytest.raises(KeyboardInterrupt):
        publish(tmp_path, OTHER, files)
    monkeypatch.undo()
    assert not (tmp_path / "report.json").exists()
    assert open_workspace(tmp_path, OTHER) is not None
    publish(tmp_path, OTHER, files)
    assert texts(tmp_path) == files


def test_a_place_below_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file, and a folder is needed"):
        open_workspace(tmp_path / "file" / "out", REQUEST)
    with pytest.raises(InputError, match="is a file, and a folder is needed"):
        open_workspace(tmp_path / "file", REQUEST)


def finish(out: Path) -> None:
    publish(out, REQUEST, {"scene/scene.json": "a", "video/drive.mp4": "a"})


@pytest.mark.parametrize(
    "name",
    [
        "video/../../victim.txt",
        "../victim.txt",
        "video/../../../{parent}/victim.txt",
        "{absolute}",
        "video//../../victim.txt",
        "scene/./../../victim.txt",
        "stages/../../victim.txt",
        "video\\..\\..\\victim.txt",
        "",
        ".",
        "..",
        "video/link/victim.txt",
        None,
        3,
        ["video"],
        {"video": 1},
        "video/\0",
        "video/" + "x" * 5000,
    ],
)
def test_names_in_a_report_delete_nothing_outside(tmp_path: Path, name: object) -> None:
    out, victim = tmp_path / "out", tmp_path / "victim.txt"
    victim.write_text("mine")
    finish(out)
    (out / "video" / "link").symlink_to(tmp_path)
    report = json.loads((out / "report.json").read_text())
    if isinstance(name, str):
        name = name.format(parent=tmp_path.name, absolute=victim)
    (out / "report.json").write_text(json.dumps({**report, "files": [*report["files"], name]}))
    (out / "video" / "drive.mp4").unlink()
    assert open_workspace(out, REQUEST) is not None
    if name == "video/link/victim.txt":
        with pytest.raises(InputError, match=r"video/link is a link; dreamdrive neither reads nor writes"):
            finish(out)
    else:
        finish(out)
    assert victim.read_text() == "mine"


@pytest.mark.parametrize("files", [None, {}, "video/drive.mp4", 3, [[[]]]])
def test_a_report_without_a_list_of_files_is_no_harm(tmp_path: Path, files: object) -> None:
    finish(tmp_path)
    report = json.loads((tmp_path / "report.json").read_text())
    (tmp_path / "report.json").write_text(json.dumps({**report, "files": files}))
    open_workspace(tmp_path, REQUEST)
    publish(tmp_path, REQUEST, {"scene/scene.json": "b"})
    assert (tmp_path / "scene" / "scene.json").read_text() == "b"


@pytest.mark.parametrize("name", ["video", "stages", "scene", "held_out", "report.json", "report.png"])
@pytest.mark.parametrize("force", [True, False])
def test_links_in_the_folder_are_refused(tmp_path: Path, name: str, force: bool) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    finish(out)
    elsewhere.mkdir()
    (elsewhere / "holiday.mp4").write_text("mine")
    if (out / name).exists():
        (out / name).rename(tmp_path / "kept")
    (out / name).symlink_to(elsewhere)
    with pytest.raises(InputError, match=f"{name} is a link; dreamdrive neither reads nor writes through"):
        open_workspace(out, REQUEST, force=force)
    assert [p.name for p in elsewhere.iterdir()] == ["holiday.mp4"]


def test_a_link_that_comes_while_the_run_goes_on_is_refused(tmp_path: Path) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    elsewhere.mkdir()
    workspace = Workspace(out, REQUEST)
    (workspace.fresh_staging() / "video").mkdir()
    (workspace.staging / "video" / "drive.mp4").write_text("a")
    (out / "video").symlink_to(elsewhere)
    with pytest.raises(InputError, match="video is a link"):
        workspace.publish({})
    assert not list(elsewhere.iterdir())


def test_staging_behind_a_link_is_not_emptied(tmp_path: Path) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "holiday.mp4").write_text("mine")
    workspace = Workspace(out, REQUEST)
    workspace.claim()
    (out / "stages" / "result").symlink_to(elsewhere)
    with pytest.raises(InputError, match="result is a link"):
        workspace.fresh_staging()
    assert (elsewhere / "holiday.mp4").exists()


def test_pipes_are_no_reports(tmp_path: Path) -> None:
    finish(tmp_path)
    (tmp_path / "report.json").unlink()
    os.mkfifo(tmp_path / "report.json")
    with pytest.raises(InputError, match=r"report\.json is not a file"):
        open_workspace(tmp_path, REQUEST)


def test_a_folder_in_the_place_of_a_file_is_said(tmp_path: Path) -> None:
    finish(tmp_path)
    (tmp_path / "video" / "drive.mp4").unlink()
    (tmp_path / "video" / "drive.mp4").mkdir()
    with pytest.raises(InputError, match=r"drive\.mp4 is a folder where a file of the result belongs"):
        finish(tmp_path)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "video").write_text("mine")
    Workspace(tmp_path / "other", REQUEST).claim()
    with pytest.raises(InputError, match="video is not a folder"):
        open_workspace(tmp_path / "other", REQUEST)
