"""Pickled tables of pandas as PandaSet has them, which may be packed, read without running them."""

import zlib
from dataclasses import dataclass
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes
from dreamdrive.files.pickles import ARRAYS, DamagedPickleError, Expected, follow

TABLES = frozenset(
    {
        "builtins slice",
        "pandas.core.frame DataFrame",
        "pandas.core.indexes.base Index",
        "pandas.core.indexes.base _new_Index",
        "pandas.core.indexes.numeric Int64Index",
        "pandas.core.indexes.range RangeIndex",
        "pandas.core.internals.managers BlockManager",
        "pandas._libs.internals _unpickle_block",
    }
)
"""What a table of pandas 0.25 to 2 names beside arrays."""


@dataclass(frozen=True)
class Most:
    """What a table may have at most, many times what those of PandaSet have.

    Attributes:
        rows: Rows.
        unpacked_bytes: Of the file, and of what it unpacks to.
        steps: Instructions of its pickle.
    """

    rows: int
    unpacked_bytes: int
    steps: int


BOXES = Most(10_000, 10_000_000, 200_000)
"""A time of PandaSet has 500 boxes, 0.1 MB and 2000 instructions."""
SWEEP = Most(2_000_000, 100_000_000, 10_000)
"""A sweep has 170,000 points and 8 MB."""
_WHAT = "a table of pandas as PandaSet has it: download it again"


def read_pickle(path: Path, most: Most) -> object:
    """The value in a ``.pkl`` or ``.pkl.gz``, see ``files.pickles.follow``.

    Raises:
        InputError: The file is missing, too large or damaged, or asks for what no table needs.
    """
    data = _unpacked(path, most.unpacked_bytes)
    try:
        return follow(data, path, Expected(ARRAYS | TABLES, most.steps, _WHAT))
    except DamagedPickleError as error:
        raise InputError(f"{path} is damaged or no pickled table ({error}); expected {_WHAT}") from None


def _unpacked(path: Path, at_most: int) -> bytes:
    """The content of a file, which may be packed by gzip."""
    data = read_bytes(path, at_most=at_most)
    if not data.startswith(b"\x1f\x8b"):
        return data
    unpack = zlib.decompressobj(16 + zlib.MAX_WBITS)
    try:
        made = unpack.decompress(data, at_most + 1)
    except zlib.error as error:
        raise InputError(f"{path} is damaged ({error}); download it again") from None
    if len(made) > at_most:
        raise InputError(f"{path} unpacks to over {at_most / 1e6:.0f} MB; expected a table of one time")
    if not unpack.eof:
        raise InputError(f"{path} is cut short; download it again")
    return made
