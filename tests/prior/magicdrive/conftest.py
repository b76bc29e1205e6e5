"""Tiny weights, a street, and upstream's numbers."""

import json
from pathlib import Path
from typing import Any

import pytest
from safetensors.torch import load_file
from tests.prior.magicdrive.tiny import Written, write_folder
from torch import Tensor

from dreamdrive.data.layout_file import write_layout
from dreamdrive.data.world import draw_street


@pytest.fixture
def folder(tmp_path: Path) -> Written:
    return write_folder(tmp_path / "magicdrive")


@pytest.fixture
def street(tmp_path: Path) -> Path:
    path = tmp_path / "street.json"
    write_layout(draw_street(3), path)
    return path


@pytest.fixture(scope="session")
def golden_folder(golden_dir: Path) -> Path:
    return golden_dir / "magicdrive"


@pytest.fixture(scope="session")
def golden(golden_folder: Path) -> dict[str, Tensor]:
    """``in.*`` and ``out.*`` of one pass and of whole runs."""
    return load_file(golden_folder / "forward.safetensors")


@pytest.fixture(scope="session")
def golden_configs(golden_folder: Path) -> dict[str, Any]:
    return json.loads((golden_folder / "tiny_config.json").read_text())
