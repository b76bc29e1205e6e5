"""The benchmarks as a package: one command each, and of other products only what these name."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from dreamdrive_bench.commands import COMMANDS, said_of
from tests.conftest import ROOT
from tests.test_house import OPEN, imported, packages, place

BENCHMARKS = ROOT / "benchmarks"
FILES = sorted((BENCHMARKS / "src/dreamdrive_bench").rglob("*.py"))
SCRIPTS = sorted(BENCHMARKS.glob("*.py"))
LOOKS_INSIDE = "dreamdrive_bench/gpu/"
"""Measures networks one by one, which packages cannot offer where an extra is missing, and packs results."""
INSIDE = ("dreamdrive.prior.", "dreamdrive.geometry.backends.dust3r.", "dreamdrive.run.codec")


@pytest.mark.parametrize("file", SCRIPTS, ids=lambda file: file.stem)
def test_a_script_runs_the_command_of_its_name(file: Path) -> None:
    assert file.stem in COMMANDS
    assert f'script("{file.stem}", __name__)' in file.read_text()


def test_each_command_says_what_it_measures_and_stands_in_the_readme() -> None:
    assert [name for name in COMMANDS if len(said_of(name)) < 20] == []
    told = re.findall(r"^\| `(\w+)` \|", (BENCHMARKS / "README.md").read_text(), re.MULTILINE)
    assert sorted(told) == sorted(COMMANDS)


def test_both_ways_lead_to_one_command_and_an_unknown_one_is_refused() -> None:
    def said(*arguments: str) -> tuple[int, str]:
        command = [sys.executable, *arguments]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout

    told = said("benchmarks/pinned.py", "--help")
    assert told[0] == 0
    assert told[1].startswith("usage: python -m dreamdrive_bench pinned")
    assert said("-m", "dreamdrive_bench", "pinned", "--help") == told
    assert said("-m", "dreamdrive_bench", "pined") == (2, "")


def test_other_products_are_imported_through_what_they_name() -> None:
    wrong = []
    for file in FILES:
        for target in sorted(imported(file)):
            where = place(target)
            if where is None or where.name == "__init__.py" or len(packages(target)) == 1:
                continue  # a package itself, or a loose file
            if LOOKS_INSIDE in str(file) and target.startswith(INSIDE):
                continue
            if target.split(".")[1] not in OPEN:
                wrong.append(f"{file.relative_to(ROOT)} imports {target}, inside {packages(target)[0]}")
    assert wrong == []
