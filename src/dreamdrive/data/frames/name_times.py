"""Times in names of images, as recorders write them: seconds since 1970, or a count of smaller units."""

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import PurePath

import numpy as np
from jaxtyping import Float

_SECONDS = re.compile(r"(?:^|\D)(\d{9,10})[._](\d{1,9})$")
_COUNT = re.compile(r"(?:^|\D)(\d{13}|\d{16}|\d{19})$")
_EARLIEST_S, _LATEST_S = 946_684_800, 4_102_444_800
"""The years 2000 and 2100: other numbers are no times."""
_NANO = 10**9


def times_of_names(files: Sequence[PurePath]) -> Float[np.ndarray, " n"] | None:
    """Seconds since the first of some files (N,), in their order; None where names tell no rising times."""
    found = [_nanoseconds(file.stem) for file in files]
    times = [each for each in found if each is not None]
    if len(times) < 2 or len(times) < len(files) or any(b <= a for a, b in pairwise(times)):
        return None
    return np.array([each - times[0] for each in times], dtype=np.float64) / _NANO


def _nanoseconds(stem: str) -> int | None:
    """Since 1970, whole: a number of seconds with all digits is more than a float holds."""
    if match := _SECONDS.search(stem):
        found = int(match[1]) * _NANO + int(match[2].ljust(9, "0"))
    elif match := _COUNT.search(stem):
        found = int(match[1].ljust(19, "0"))
    else:
        return None
    return found if _EARLIEST_S <= found // _NANO <= _LATEST_S else None
