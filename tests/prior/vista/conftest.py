"""Weights that several tests read."""

from pathlib import Path

import pytest

from dreamdrive.prior.vista.kinds import SVD, VISTA
from tests.prior.vista.tiny import save_folder, save_official


@pytest.fixture(scope="session")
def vista_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tiny Vista in diffusers' layout."""
    return save_folder(tmp_path_factory.mktemp("vista"), VISTA)


@pytest.fixture(scope="session")
def svd_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tiny SVD in diffusers' layout."""
    return save_folder(tmp_path_factory.mktemp("svd"), SVD)


@pytest.fixture(scope="session")
def vista_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tiny Vista as the official file has it."""
    return save_official(tmp_path_factory.mktemp("official") / "vista.safetensors", VISTA)
