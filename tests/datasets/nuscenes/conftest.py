"""A small data set in the format of nuScenes."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def folder(one_drive: Path, tmp_path: Path) -> Path:
    """One drive, written."""
    return shutil.copytree(one_drive, tmp_path / "set")


@pytest.fixture
def change(folder: Path) -> Callable[[str, Callable[[list[dict[str, Any]]], object]], None]:
    """Change the rows of a table in place."""

    def changed(table: str, by: Callable[[list[dict[str, Any]]], object]) -> None:
        path = folder / "v1.0-mini" / f"{table}.json"
        rows = json.loads(path.read_text())
        by(rows)
        path.write_text(json.dumps(rows))

    return changed
