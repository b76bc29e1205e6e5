"""Tiny weights and upstream's numbers."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from safetensors.torch import load_file
from tests.prior.magicdrive.tiny import Written, write_folder
from torch import Tensor


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """To be read only."""
    return write_folder(tmp_path_factory.mktemp("magicdrive") / "weights")


@pytest.fixture
def folder(written: Written, tmp_path: Path) -> Written:
    """A copy."""
    return replace(written, path=Path(shutil.copytree(written.path, tmp_path / "magicdrive")))


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
