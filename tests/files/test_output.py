"""The one door for output: whole or absent, one writer, nothing foreign touched, nothing left behind."""

import errno
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import torch
from hypothesis import HealthCheck, given, settings, strategies as st
from safetensors.torch import save_file

from dreamdrive.errors import InputError
from dreamdrive.files.output import (
    MARK,
    check_free,
    claim_folder,
    new_file,
    new_folder,
    plain_name,
    scratch_beside,
    temporary_folder,
)

KIND = "set of things"


def tree(folder: Path) -> dict[str, bytes | str | None]:
    """All that lies below a folder: bytes of files, aims of links, None for folders."""
    found: dict[str, bytes | str | None] = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        found[name] = (
            os.readlink(path) if path.is_symlink() else path.read_bytes() if path.is_file() else None
        )
    return found


def write(path: Path, text: str = "new") -> None:
    with new_file(path) as place:
        place.write_text(text)


def fill(path: Path, *, replace: bool = True, text: str = "new", kind: str = KIND) -> None:
    with new_folder(path, replace=replace, kind=kind) as made:
        (made / "below").mkdir()
        (made / "below" / "a.txt").write_text(text)


def test_a_file_and_a_folder_appear_with_all_that_is_above_them(tmp_path: Path) -> None:
    write(tmp_path / "x" / "y" / "a.txt")
    fill(tmp_path / "x" / "z" / "set")
    assert set(tree(tmp_path)) == {
        *("x", "x/y", "x/y/a.txt", "x/z", "x/z/set", f"x/z/set/{MARK}"),
        *("x/z/set/below", "x/z/set/below/a.txt"),
    }
    assert json.loads((tmp_path / "x/z/set" / MARK).read_text()) == {
        "dreamdrive": KIND,
        "files": ["below/a.txt"],
    }


@pytest.mark.parametrize("make", [write, fill])
def test_a_failure_leaves_nothing(tmp_path: Path, make: Callable[[Path], None]) -> None:
    (tmp_path / "there").mkdir()
    before = tree(tmp_path)
    opened = new_file if make is write else lambda path: new_folder(path, replace=True, kind=KIND)
    with pytest.raises(RuntimeError), opened(tmp_path / "deep" / "deeper" / "a"):
        raise RuntimeError
    assert tree(tmp_path) == before


def test_a_longest_name_can_be_written(tmp_path: Path) -> None:
    write(tmp_path / ("n" * 255))
    fill(tmp_path / ("f" * 255))
    with pytest.raises(InputError, match="name too long"):
        write(tmp_path / ("n" * 256))


def test_only_what_was_made_here_and_nothing_else_is_replaced(tmp_path: Path) -> None:
    fill(tmp_path / "set")
    fill(tmp_path / "set", text="newer")
    assert (tmp_path / "set/below/a.txt").read_text() == "newer"
    with pytest.raises(InputError, match="exists already"):
        fill(tmp_path / "set", replace=False)
    with pytest.raises(InputError, match="it is no other kind of dreamdrive's"):
        fill(tmp_path / "set", kind="other kind")
    # What the system puts into folders is nobody's.
    (tmp_path / "set/below/.DS_Store").write_text("x")
    fill(tmp_path / "set")
    (tmp_path / "set/below/mine.txt").write_text("mine")
    before = tree(tmp_path)
    with pytest.raises(InputError, match=r"holds other files \(below/mine.txt\)"):
        fill(tmp_path / "set")
    assert tree(tmp_path) == before


@pytest.mark.parametrize(
    "mark",
    [
        *(None, "", "[]", "{", '{"dreamdrive": "set of things"}', '{"dreamdrive": 1, "files": []}'),
        '{"dreamdrive": "set of things", "files": {"mine": 1}}',
    ],
)
@pytest.mark.parametrize("name", ["manifest.json", "layout.json", "static.ply", "v1.0-mini/scene.json"])
def test_folders_of_others_are_left_alone(tmp_path: Path, name: str, mark: str | None) -> None:
    folder = tmp_path / "theirs"
    (folder / name).parent.mkdir(parents=True)
    (folder / name).write_text("theirs")
    if mark is not None:
        (folder / MARK).write_text(mark)
    before = tree(tmp_path)
    for attempt in (fill, lambda p: check_free(p, True, KIND), lambda p: claim_folder(p, KIND)):
        with pytest.raises(InputError):
            attempt(folder)
    assert tree(tmp_path) == before


def test_links_are_followed_and_stay(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "file").symlink_to("disk/real.txt")
    (tmp_path / "folder").symlink_to("disk/real")
    for text in ("first", "second"):
        write(tmp_path / "file", text)
        fill(tmp_path / "folder", text=text)
        assert (tmp_path / "disk/real.txt").read_text() == text
        assert (tmp_path / "disk/real/below/a.txt").read_text() == text
    assert (tmp_path / "file").is_symlink()
    assert (tmp_path / "folder").is_symlink()
    assert sorted(p.name for p in (tmp_path / "disk").iterdir()) == ["real", "real.txt"]


@pytest.mark.parametrize("aim", ["gone/a", "loop", "/proc/self/mem", "."])
def test_links_that_lead_nowhere_are_refused(tmp_path: Path, aim: str) -> None:
    (tmp_path / "loop").symlink_to(aim)
    before = tree(tmp_path)
    for attempt in (write, fill):
        with pytest.raises(InputError):
            attempt(tmp_path / "loop")
    assert tree(tmp_path) == before


def test_pipes_and_devices_are_no_place_for_a_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "pipe", Path("/dev/null"), tmp_path):
        with pytest.raises(InputError, match="no regular file"):
            write(place)


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(), st.text())
def test_names_from_data_stay_where_they_are_put(tmp_path: Path, one: str, other: str) -> None:
    for name in (one, other):
        plain = plain_name(name)
        assert Path(plain).name == plain
        assert not plain.startswith(".")
        assert len(os.fsencode(plain)) <= 120
        assert plain_name(plain) == plain
    assert (plain_name(one) == plain_name(other)) == (one == other) or plain_name(one) == other
    write(tmp_path / plain_name(one))


@pytest.mark.parametrize(
    "name",
    ["/etc/passwd", "../../labels", "CAM/FRONT", "a\0b", "..", "", ".ssh", "n" * 300, "\udcff", "-rf ~"],
)
def test_hostile_names_become_plain_ones(name: str) -> None:
    plain = plain_name(name)
    assert plain != name
    assert plain_name("CAM_FRONT") == "CAM_FRONT"
    assert set(plain) <= set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._+=@-")


SLOW = """
import sys, time
from pathlib import Path
from dreamdrive.cli.terminal.machine import stop_like_an_interruption
from dreamdrive.files.output import new_file, new_folder
stop_like_an_interruption()
what, place, seconds = sys.argv[1], Path(sys.argv[2]), float(sys.argv[3])
print("begun", flush=True)
while True:
    with new_file(place) if what == "file" else new_folder(place, replace=True, kind="set of things") as made:
        for k in range(20):
            target = made if what == "file" else made / f"{k}"
            with target.open("a") as file:
                file.write("x" * 1000)
            time.sleep(seconds)
"""


def heeding() -> None:
    """Heed signals that these tests were told to ignore, as behind nohup or in the background of a shell."""
    for number in (signal.SIGHUP, signal.SIGINT):
        signal.signal(number, signal.SIG_DFL)


def slowly(what: str, place: Path, seconds: float = 0.001) -> "subprocess.Popen[str]":
    arguments = [sys.executable, "-c", SLOW, what, str(place), str(seconds)]
    process = subprocess.Popen(
        arguments,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        preexec_fn=heeding,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    return process


def whole(place: Path) -> bool:
    """Whether nothing or all of a result is there."""
    if not place.exists():
        return True
    if place.is_file():
        return place.stat().st_size == 20_000
    return sorted(p.name for p in place.iterdir()) == sorted([*map(str, range(20)), MARK])


@pytest.mark.parametrize("what", ["file", "folder"])
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGKILL])
def test_stopped_at_any_moment_nothing_half_done_stays(
    tmp_path: Path, what: str, how: signal.Signals
) -> None:
    place = tmp_path / "out" / "result"
    for moment in range(3):
        with slowly(what, place) as process:
            time.sleep(0.009 * moment)
            process.send_signal(how)
        assert whole(place)
    # What a killed writer left goes away with the next.
    (write if what == "file" else fill)(place)
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"result"}


@pytest.mark.parametrize("what", ["file", "folder"])
def test_a_second_writer_is_sent_away_and_harms_nothing(tmp_path: Path, what: str) -> None:
    place = tmp_path / "result"
    with slowly(what, place, seconds=1.0) as process:
        time.sleep(0.2)
        with pytest.raises(InputError, match=f"is in use: process {process.pid}"):
            (write if what == "file" else fill)(place)
        write(tmp_path / "another")
        process.terminate()
    assert {p.name for p in tmp_path.iterdir()} == {"another"}


@contextmanager
def files_of_at_most(count: int) -> Iterator[None]:
    """As on a disk that is full behind so many bytes of each file."""
    limits, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (count, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)


def test_tensors_on_a_full_disk_are_an_error_of_the_disk(tmp_path: Path) -> None:
    place, values = tmp_path / "a.safetensors", {"x": torch.zeros(5000)}
    with pytest.raises(InputError, match="too large"), files_of_at_most(1000), new_file(place) as partial:
        save_file(values, partial)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("what", ["file", "folder"])
def test_a_full_disk_is_said_and_nothing_is_left(tmp_path: Path, what: str) -> None:
    place = tmp_path / "result"
    (write if what == "file" else fill)(place)
    before = tree(tmp_path)
    with pytest.raises(InputError, match=r"cannot write .*; nothing was changed"), files_of_at_most(1000):
        (write if what == "file" else fill)(place, text="x" * 5000)
    assert tree(tmp_path) == before


def test_a_claimed_folder_may_be_gone_on_in(tmp_path: Path) -> None:
    folder = tmp_path / "work"
    claim_folder(folder, "training")
    (folder / "checkpoint-1.safetensors").write_text("state")
    claim_folder(folder, "training")
    with pytest.raises(InputError, match="no other work of dreamdrive"):
        claim_folder(folder, "other work")


def test_what_is_needed_meanwhile_lies_beside_the_result(tmp_path: Path) -> None:
    place = tmp_path / "made" / "result"
    with scratch_beside(place) as scratch:
        (scratch / "picture").write_text("picture")
        assert scratch.parent == place.parent
        fill(place)
        assert (scratch / "picture").exists()
    assert [path.name for path in place.parent.iterdir()] == ["result"]


NO_ROOM = "no room for temporary files in .*; free some space there, or name a folder on another disk"


def test_no_room_for_temporary_files_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(InputError, match=NO_ROOM), temporary_folder():
        raise OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(RuntimeError, match=r"^SQLite"), temporary_folder():
        raise RuntimeError("SQLite: no such table")
    with (
        pytest.raises(InputError, match=NO_ROOM),
        files_of_at_most(1000),
        temporary_folder(),
    ):
        raise RuntimeError("SQLite: any of its words")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    with pytest.raises(InputError, match=NO_ROOM), temporary_folder():
        raise AssertionError("there is no such folder")


def test_temporary_folders_of_killed_processes_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not those that are held or young, nor what links lead to."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "mine").mkdir()
    (tmp_path / "dreamdrive-link").symlink_to("mine")
    for name in ("dreamdrive-left", "dreamdrive-young"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "a.txt").write_text("x")
    os.utime(tmp_path / "dreamdrive-left", (0, 0))
    with temporary_folder() as held:
        os.utime(held, (0, 0))
        with temporary_folder():
            assert held.is_dir()
    assert {p.name for p in tmp_path.iterdir()} == {"mine", "dreamdrive-link", "dreamdrive-young"}
