"""A release is called the same everywhere, and what was to go with it has gone."""

import subprocess
import tomllib

import pytest

import dreamdrive
from dreamdrive.registry import GOES_WITH, MOVED
from tests.conftest import ROOT
from tests.release import disagreements

VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
CHANGES = "## 0.2.0 (2027-01-02)\n\nText.\n\n## 0.1.0 (2026-12-01)\n"


def tags_here() -> list[str]:
    command = ["git", "-C", str(ROOT), "tag", "--points-at", "HEAD"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    except (OSError, subprocess.CalledProcessError):
        return []  # a copy without its history has no tags


def test_this_version_is_called_the_same_everywhere() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text()
    assert disagreements(changelog, VERSION, dreamdrive.__version__, tags_here()) == []


@pytest.mark.parametrize("tags", [[], ["v0.2.0"], ["v0.2.0", "measured-2027-01-02"]])
def test_what_agrees(tags: list[str]) -> None:
    assert disagreements(CHANGES, "0.2.0", "0.2.0", tags) == []


def test_changes_gather_between_releases() -> None:
    assert disagreements(f"## Unreleased\n\nMore.\n\n{CHANGES}", "0.2.0", "0.2.0", []) == []


@pytest.mark.parametrize(
    ("changelog", "package", "tags", "said"),
    [
        (CHANGES, "0.1.0", [], "the package says 0.1.0"),
        ("## 0.1.0 (2026-12-01)\n", "0.2.0", [], "in CHANGELOG.md is 0.1.0"),
        ("## 0.2.0 (unreleased)\n", "0.2.0", [], "in CHANGELOG.md is none"),
        (CHANGES, "0.2.0", ["v0.1.0"], "tagged v0.1.0, expected v0.2.0"),
        (CHANGES, "0.2.0", ["v0.1.0", "v0.2.0"], "tagged v0.1.0 v0.2.0"),
        (f"## Unreleased\n{CHANGES}", "0.2.0", ["v0.2.0"], "called unreleased"),
    ],
)
def test_what_disagrees(changelog: str, package: str, tags: list[str], said: str) -> None:
    (found,) = disagreements(changelog, "0.2.0", package, tags)
    assert said in found


def test_old_names_have_gone_with_the_version_that_was_named() -> None:
    assert not MOVED or minor(VERSION) < minor(GOES_WITH), (
        f"remove what dreamdrive.registry has: {list(MOVED)}"
    )


def minor(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split(".")[:2])
