"""What all tests of splatting share."""

from collections.abc import Generator

import pytest

from dreamdrive.compute.threads import one_torch_thread


@pytest.fixture(scope="package", autouse=True)
def _no_torch_workers() -> Generator[None, None, None]:
    """Tiny tensors on one thread: torch's spinning workers made these tests four times slower."""
    with one_torch_thread():
        yield
