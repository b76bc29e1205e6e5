"""Tests against golden numbers hold for other shapes: nothing of them is written in a test."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT

READERS = (
    "tests/benchmarks/geometry",
    "tests/evaluate",
    "tests/geometry/backends/dust3r",
    "tests/prior",
)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_the_tests_pass_on_numbers_of_other_shapes(tmp_path: Path, seed: int) -> None:
    def run(module: str, *options: str) -> str:
        command = [sys.executable, "-m", module, *options]
        environment = os.environ | {"DREAMDRIVE_GOLDEN": str(tmp_path / "set")}
        done = subprocess.run(command, cwd=ROOT, env=environment, check=False, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
        return done.stdout

    run("tests.golden.make", str(tmp_path / "set"), "--seed", str(seed))
    told = run("pytest", "-q", "-n0", "-p", "no:cacheprovider", "-k", "golden", *READERS)
    passed = re.search(r"(\d+) passed", told)
    assert passed is not None
    assert int(passed[1]) > 130
