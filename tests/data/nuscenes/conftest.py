"""A small data set in the format of nuScenes."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.logs import log

from dreamdrive.data.lidar_file import read_points
from dreamdrive.data.nuscenes import write_nuscenes


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """One drive, written."""
    write_nuscenes([log(tmp_path / "made")], tmp_path / "set", read_points)
    return tmp_path / "set"


@pytest.fixture
def change(folder: Path) -> Callable[[str, Callable[[list[dict[str, Any]]], object]], None]:
    """Change the rows of a table in place."""

    def changed(table: str, by: Callable[[list[dict[str, Any]]], object]) -> None:
        path = folder / "v1.0-mini" / f"{table}.json"
        rows = json.loads(path.read_text())
        by(rows)
        path.write_text(json.dumps(rows))

    return changed
