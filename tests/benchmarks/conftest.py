"""What several benchmarks are tried on."""

import pytest

from streetworld import DrawnDrive, make_street


@pytest.fixture(scope="session")
def made() -> DrawnDrive:
    """A street of the second edition."""
    return make_street(3, 2, size=(96, 56), edition=2)
