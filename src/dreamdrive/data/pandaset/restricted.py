"""Pickled tables of pandas as PandaSet has them, which may be packed, read without running them."""

import zlib
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes
from dreamdrive.files.pickles import ARRAYS, DamagedError, Expected, follow

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
MOST_BYTES = 200_000_000
"""Of a file, and of what it unpacks to: a sweep of PandaSet has 8 MB."""
EXPECTED = Expected(
    ARRAYS | TABLES,
    2_000_000,  # cuboids take 2000
    "a table of pandas as PandaSet has it: download it again",
)


def read_pickle(path: Path) -> object:
    """The value in a ``.pkl`` or ``.pkl.gz``, see ``files.pickles.follow``.

    Raises:
        InputError: The file is missing, too large or damaged, or asks for what no table needs.
    """
    data = _unpacked(path)
    try:
        return follow(data, path, EXPECTED)
    except DamagedError as error:
        raise InputError(
            f"{path} is damaged or no pickled table ({error}); expected {EXPECTED.what}"
        ) from None


def _unpacked(path: Path) -> bytes:
    """The content of a file, which may be packed by gzip."""
    data = read_bytes(path, at_most=MOST_BYTES)
    if not data.startswith(b"\x1f\x8b"):
        return data
    unpack = zlib.decompressobj(16 + zlib.MAX_WBITS)
    try:
        made = unpack.decompress(data, MOST_BYTES + 1)
    except zlib.error as error:
        raise InputError(f"{path} is damaged ({error}); download it again") from None
    if len(made) > MOST_BYTES:
        raise InputError(f"{path} unpacks to over {MOST_BYTES / 1e6:.0f} MB; expected a table of one time")
    if not unpack.eof:
        raise InputError(f"{path} is cut short; download it again")
    return made
