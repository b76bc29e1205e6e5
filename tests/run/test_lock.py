"""One run at a time in a folder, whatever became of the one before."""

import os
import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from dreamdrive.errors import InputError
from dreamdrive.run.lock import NAME, only_run

HOLD = """
import sys, time
from pathlib import Path
from dreamdrive.run.lock import only_run
with only_run(Path(sys.argv[1])):
    print("locked", flush=True)
    time.sleep(60)
"""


def hold(out: Path) -> "subprocess.Popen[str]":
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(out)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "locked\n"
    return process


def test_a_second_run_is_told_of_the_first_and_a_killed_one_hinders_nobody(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    with hold(out) as process:
        with pytest.raises(InputError) as caught, only_run(out):
            pass
        wanted = rf"{out} is in use: process {process.pid}, started \d{{4}}-\S+ \(-c {out}\), works there; "
        wanted += "wait until it has finished, stop it, or choose another output folder"
        assert re.fullmatch(wanted, str(caught.value))
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert (out / NAME).exists()
    with only_run(out):
        pass
    assert not (out / NAME).exists()


def test_the_folder_goes_away_with_a_run_that_left_nothing(tmp_path: Path) -> None:
    with only_run(tmp_path / "deep" / "out"):
        assert (tmp_path / "deep" / "out").is_dir()
    assert not (tmp_path / "deep").exists()
    with only_run(tmp_path / "out"):
        (tmp_path / "out" / "report.json").write_text("")
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["report.json"]


def test_a_second_run_in_the_same_process_waits_outside(tmp_path: Path) -> None:
    with only_run(tmp_path):
        with pytest.raises(InputError, match=f"process {os.getpid()},"), only_run(tmp_path):
            pass
        assert (tmp_path / NAME).exists()


@pytest.mark.parametrize("note", [b"", b"{", b'{"process": "x"}', b"[" * 4000])
def test_a_lock_without_a_note_is_a_lock(tmp_path: Path, note: bytes) -> None:
    with only_run(tmp_path):
        (tmp_path / NAME).write_bytes(note)
        with pytest.raises(InputError, match="in use: another process works there"), only_run(tmp_path):
            pass


@pytest.mark.parametrize("kind", ["link", "hard link", "pipe", "folder"])
def test_a_lock_that_is_something_else_is_left_alone(tmp_path: Path, kind: str) -> None:
    out, victim = tmp_path / "out", tmp_path / "victim"
    out.mkdir()
    victim.write_text("mine")
    if kind == "link":
        (out / NAME).symlink_to(victim)
    elif kind == "hard link":
        (out / NAME).hardlink_to(victim)
    elif kind == "pipe":
        os.mkfifo(out / NAME)
    else:
        (out / NAME).mkdir()
    with pytest.raises(InputError), only_run(out):
        pass
    assert victim.read_text() == "mine"
    assert (out / NAME).exists()


def test_what_killed_runs_left_among_temporary_files_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    left = tmp_path / "dreamdrive-left"
    (left / "deep").mkdir(parents=True)
    os.utime(left, (0, 0))
    with only_run(tmp_path / "out"):
        assert not left.exists()
