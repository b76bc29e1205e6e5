"""Shared places and checks of the test-suite."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# What else runs on the machine is no failure of a test.
settings.register_profile("any machine", deadline=None)
settings.load_profile("any machine")
ROOT = Path(__file__).resolve().parents[1]


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
