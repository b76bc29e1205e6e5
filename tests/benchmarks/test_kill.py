"""A run that is really killed goes on, and ends with the bytes of a run in one go."""

import signal
from pathlib import Path

import pytest

from dreamdrive_bench import kill

SMALL = ["--prior", "street-world", "--frames", "0:5", "--size", "64x40", "--quality", "draft"]


@pytest.mark.slow
def test_runs_killed_at_any_moment_end_with_the_same_bytes(tmp_path: Path) -> None:
    kills = kill.measure(tmp_path, SMALL, times=4, seed=3)
    assert [each.different for each in kills] == [()] * 4


@pytest.mark.slow
def test_a_run_that_is_asked_to_terminate_keeps_its_stages(tmp_path: Path) -> None:
    process = kill.start(tmp_path / "out", SMALL)
    for line in process.stdout:
        if line.startswith("initialise:"):
            process.send_signal(signal.SIGTERM)
            break
    said = process.communicate()[0]
    assert process.returncode == 143
    assert "Traceback" not in said
    assert not (tmp_path / "out" / "report.json").exists()
    assert (tmp_path / "out" / "stages" / "geometry" / "result.json").is_file()
    again = kill.start(tmp_path / "out", SMALL).communicate()[0]
    assert "geometry: 0.0 s" in again
