"""How a command ends: what its reader, its terminal and memory do to it."""

import os
import subprocess
import sys
from pathlib import Path

import cv2
import pytest

from dreamdrive.cli import main as module
from tests.cli.conftest import Run

COMMAND = [sys.executable, "-c", "from dreamdrive.cli.main import main; main()"]


def refused_memory() -> None:
    raise MemoryError


def refused_by_opencv() -> None:
    raise cv2.error("OpenCV(4.11) alloc.cpp: error: (-4:Insufficient memory) Failed to allocate 8 bytes")


def refused_by_torch() -> None:
    raise RuntimeError(
        "[enforce fail] DefaultCPUAllocator: can't allocate memory: you tried to allocate 8 bytes"
    )


@pytest.mark.parametrize("fails", [refused_memory, refused_by_opencv, refused_by_torch])
def test_memory_that_ends_is_said(run: Run, monkeypatch: pytest.MonkeyPatch, fails) -> None:
    monkeypatch.setattr(module.tyro.extras, "subcommand_cli_from_dict", lambda *a, **k: fails())
    result = run("doctor")
    assert result.code == 2
    assert result.err.startswith("error: memory is used up; choose fewer frames with --frames")


def test_other_errors_keep_their_traceback(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise RuntimeError("a mistake of ours")

    monkeypatch.setattr(module.tyro.extras, "subcommand_cli_from_dict", fails)
    with pytest.raises(RuntimeError, match="a mistake of ours"):
        run("doctor")


@pytest.mark.parametrize("words", [("doctor",), ("generate", "--help")])
def test_nobody_who_reads_on_ends_it_without_a_word(words: tuple[str, ...]) -> None:
    """As behind ``| head``: no traceback."""
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([*COMMAND, *words], stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert done.returncode == 1
    assert done.stderr == ""


def test_what_a_terminal_cannot_show_does_not_end_the_work(tmp_path: Path) -> None:
    missing = tmp_path / "Straße 7 →.mp4"
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(
        [*COMMAND, "look", str(missing), "-o", str(tmp_path / "o")],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    assert done.returncode == 2
    assert "Stra?e 7 ?.mp4" in done.stderr.replace("\n", "")
    assert "Traceback" not in done.stderr
