"""A run that is really killed goes on, and ends with the bytes of a run in one go."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest


def start(out: Path) -> "subprocess.Popen[str]":
    command = [sys.executable, "-u", "-c", "from dreamdrive.cli.main import main; main()", "generate"]
    options = ["--prior", "street-world", "--frames", "0:5", "--size", "64x40", "--quality", "draft"]
    return subprocess.Popen(
        [*command, *options, "-o", str(out)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def finish(out: Path) -> None:
    process = start(out)
    process.communicate()
    assert process.returncode == 0


def scene_bytes(out: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted((out / "scene").iterdir())}


@pytest.mark.slow
def test_a_killed_process_resumes_to_the_same_bytes(tmp_path: Path) -> None:
    finish(tmp_path / "whole")
    for stage, blow, code in (("geometry", signal.SIGTERM, 143), ("static", signal.SIGKILL, -signal.SIGKILL)):
        process = start(tmp_path / "killed")
        assert process.stdout is not None
        assert process.stderr is not None
        for line in process.stdout:
            if line.startswith(f"{stage}:"):
                process.send_signal(blow)
                break
        with process:
            said = process.stderr.read()
        assert process.returncode == code
        if blow == signal.SIGTERM:
            assert "the same command goes on from there" in said
            assert "Traceback" not in said
        assert not (tmp_path / "killed" / "report.json").exists()
    finish(tmp_path / "killed")
    assert scene_bytes(tmp_path / "killed") == scene_bytes(tmp_path / "whole")
