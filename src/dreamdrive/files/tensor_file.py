"""Checks of files of tensors, ``.safetensors`` and zip archives, before a library maps them."""

import os
from pathlib import Path
from typing import BinaryIO

from safetensors import SafetensorError

from dreamdrive.compute.machine import free_bytes
from dreamdrive.errors import InputError
from dreamdrive.files.paths import open_file, read_bytes

HEADER_BYTES = 4_000_000
"""Most that the table of tensors in a file may hold, which takes sixty times as much memory; that of Vista
takes half a megabyte."""
DAMAGE = (
    SafetensorError,
    OSError,
    ValueError,
    KeyError,
    TypeError,
    AttributeError,
    RuntimeError,
    OverflowError,
)
"""What the library raises on files that are damaged, or state shapes that cannot be."""
_LONGEST = 200
_TAIL = 66_000
_END, _END_64, _LOCATOR = b"PK\5\6", b"PK\6\6", b"PK\6\7"


def header_problem(path: Path) -> str | None:
    """Why a file is no ``.safetensors``, by the stated length of its header; None where it may be one."""
    try:
        with open_file(path, "the file") as file:
            return _stated(file.read(8), os.fstat(file.fileno()).st_size)
    except InputError as error:
        return str(error)


def read_own(path: Path, where: str = "") -> bytes:
    """A file of tensors that dreamdrive wrote, no link, if memory holds it twice: as bytes and as tensors."""
    free = free_bytes()
    data = read_bytes(path, where, at_most=2**40 if free is None else free // 2, follow=False)
    if problem := _stated(data[:8], len(data)):
        raise InputError(f"{where or path} holds no tensors: {problem}")
    return data


def _stated(start: bytes, size: int) -> str | None:
    """What is wrong with the length of the header, which is in the first bytes of a file."""
    header = int.from_bytes(start, "little")
    if 2 <= header <= min(size - 8, HEADER_BYTES):
        return None
    return f"it states a header of {header} bytes and has {size}"


def briefly(error: object) -> str:
    """What a library says of a file, on one line, without all that it repeats from the file."""
    said = " ".join(str(error).split())
    return said if len(said) <= _LONGEST else said[:_LONGEST] + "..."


def directory_bytes(file: BinaryIO) -> int:
    """Bytes that the table of contents of a zip archive claims; 0 where there is none.

    Reading it takes ten times as much memory.
    """
    size = file.seek(0, 2)
    file.seek(max(size - _TAIL, 0))
    tail = file.read(_TAIL)
    file.seek(0)
    end = tail.rfind(_END)
    if end < 0:
        return 0
    claims = int.from_bytes(tail[end + 12 : end + 16], "little")
    # Large archives have a second end before the first: of 56 bytes, and 20 that say where it is.
    if end >= 76 and tail[end - 20 : end - 16] == _LOCATOR and tail[end - 76 : end - 72] == _END_64:
        claims = max(claims if claims < 2**32 - 1 else 0, int.from_bytes(tail[end - 36 : end - 28], "little"))
    return claims
