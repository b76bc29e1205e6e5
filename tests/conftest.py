"""Shared places and checks of the test-suite."""

import gc
import os
from pathlib import Path

import pytest
from hypothesis import settings

from tests.limit import Limit

# As commands have it, before torch is there: beside another worker threads that spin take ten times as long.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
# The same examples every time, so many, and what else runs on the machine is no failure of a test.
settings.register_profile("the same everywhere", max_examples=50, derandomize=True, deadline=None)
settings.load_profile("the same everywhere")
ROOT = Path(__file__).resolve().parents[1]


def pytest_configure(config: pytest.Config) -> None:
    # Thousands of tests and all that they import stay: to look through them for garbage again and again takes
    # a tenth of the time.
    gc.set_threshold(50_000)
    config.pluginmanager.register(Limit(), "limit")


def _shared(variable: str, default: str) -> Path:
    path = Path(os.environ.get(variable, ROOT / default))
    if not path.is_dir():
        pytest.skip(f"{variable} ({path}) is not there")
    return path


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Real recordings; the test is skipped where they are absent."""
    return _shared("DREAMDRIVE_DATA", "../shared/data")


@pytest.fixture(scope="session")
def bench_dir() -> Path:
    """The scenes in ``DREAMDRIVE_BENCH``; the test is skipped where they are absent."""
    return _shared("DREAMDRIVE_BENCH", "../shared/bench")


@pytest.fixture(scope="session")
def one_drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set of one drive in the format of nuScenes; who changes it takes a copy."""
    from dreamdrive.datasets.lidar_file import read_points  # here: most tests do without
    from dreamdrive.export.nuscenes.writer import write_nuscenes
    from tests.logs import log

    folder = tmp_path_factory.mktemp("drive")
    write_nuscenes([log(folder / "made")], folder / "set", read_points)
    return folder / "set"


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short run of six frames, one of them withheld; who changes it takes a copy."""
    from tests.test_generate import make, shorten  # here: most tests do without the pipeline

    out = tmp_path_factory.mktemp("run") / "out"
    with pytest.MonkeyPatch.context() as patch:
        shorten(patch)
        assert not make(out).already_finished
    return out
