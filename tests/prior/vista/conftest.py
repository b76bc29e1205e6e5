"""Weights that several tests read."""

from pathlib import Path

import pytest
from safetensors.torch import load_file
from tests.prior.vista.tiny import save_folder, save_official
from torch import Tensor

from dreamdrive.prior.vista.kinds import SVD, VISTA


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


class Golden:
    """Numbers of the public code."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def tensors(self, name: str) -> dict[str, Tensor]:
        return load_file(self.folder / f"{name}.safetensors")


@pytest.fixture(scope="session")
def golden(golden_dir: Path) -> Golden:
    if not (golden_dir / "vista").is_dir():
        pytest.skip("the golden numbers of Vista are not there")
    return Golden(golden_dir / "vista")
