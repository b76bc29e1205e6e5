"""Tiny weights."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from tests.prior.magicdrive.tiny import Written, write_folder


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """To be read only."""
    return write_folder(tmp_path_factory.mktemp("magicdrive") / "weights")


@pytest.fixture
def folder(written: Written, tmp_path: Path) -> Written:
    """A copy."""
    return replace(written, path=Path(shutil.copytree(written.path, tmp_path / "magicdrive")))
