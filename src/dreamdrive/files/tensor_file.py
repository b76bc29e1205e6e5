"""Files of tensors, ``.safetensors``: what can be said of them before the library maps them."""

import os
from pathlib import Path

from safetensors import SafetensorError

from dreamdrive.errors import InputError
from dreamdrive.files.paths import open_file, read_bytes
from dreamdrive.machine import free_bytes

HEADER_BYTES = 16_000_000
"""Most that the table of tensors in a file may hold; that of Vista takes half a megabyte."""
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


def header_problem(path: Path) -> str | None:
    """Why a file is no ``.safetensors``, by the stated length of its header; None where it may be one."""
    try:
        with open_file(path, "the file") as file:
            size = os.fstat(file.fileno()).st_size
            header = int.from_bytes(file.read(8), "little")
    except InputError as error:
        return str(error)
    if 2 <= header <= min(size - 8, HEADER_BYTES):
        return None
    return f"it states a header of {header} bytes and has {size}"


def read_own(path: Path, where: str = "") -> bytes:
    """A file of tensors that dreamdrive wrote, no link, if memory holds it twice: as bytes and as tensors."""
    free = free_bytes()
    return read_bytes(path, where, at_most=2**40 if free is None else free // 2, follow=False)


def briefly(error: object) -> str:
    """What a library says of a file, on one line, without all that it repeats from the file."""
    said = " ".join(str(error).split())
    return said if len(said) <= _LONGEST else said[:_LONGEST] + "..."
