"""Arrays in NPZ and NPY files, read only as far as their headers are believable; pickles never are."""

import math
import warnings
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from tokenize import TokenError
from typing import IO

import numpy as np
from jaxtyping import Shaped, UInt8

from dreamdrive.errors import InputError
from dreamdrive.files.paths import open_file
from dreamdrive.files.tensor_file import briefly, directory_bytes

ARRAY_BYTES = 256_000_000
"""Bytes that arrays may take, a number counting as at least four: depth of 64 megapixels."""
_DIRECTORY_BYTES = 1_000_000
"""Most that the table of contents of an NPZ may hold; each array takes about 100 bytes there."""
_CHUNK = 1 << 20
_MOST_SIDES = 8
# A member of a zip is none of typing's kinds of files.
_Stream = IO[bytes] | zipfile.ZipExtFile
# What zipfile and NumPy raise on damaged files.
_DAMAGE = (
    OSError,
    ValueError,
    KeyError,
    EOFError,
    RuntimeError,
    zlib.error,
    MemoryError,
    SyntaxError,
    TypeError,
)


def read_npz(path: Path, names: Sequence[str], *, at_most: int = ARRAY_BYTES) -> dict[str, np.ndarray]:
    """Those of the named arrays that are in an NPZ, which may take ``at_most`` bytes together."""
    with open_file(path) as file:
        try:
            if directory_bytes(file) > _DIRECTORY_BYTES:
                raise InputError("holds more files than an npz with a few arrays")
            with zipfile.ZipFile(file) as archive:
                return _members(archive, names, at_most)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        except (*_DAMAGE, zipfile.BadZipFile) as error:
            raise InputError(f"{path} cannot be read as an npz ({briefly(error)})") from error


def read_npy(path: Path) -> Shaped[np.ndarray, "*d"]:
    """The array in an NPY."""
    with open_file(path) as file:
        try:
            return _array(file, ARRAY_BYTES)
        except InputError as error:
            raise InputError(f"{path}: the array {error}") from None
        except _DAMAGE as error:
            raise InputError(f"{path} cannot be read as an npy ({briefly(error)})") from error


def _members(archive: zipfile.ZipFile, names: Sequence[str], at_most: int) -> dict[str, np.ndarray]:
    found: dict[str, np.ndarray] = {}
    there = set(archive.namelist())
    for name in names:
        member = next((each for each in (f"{name}.npy", name) if each in there), None)
        if member is None:
            continue
        if archive.getinfo(member).compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise InputError(f"{name} is compressed in a way that NumPy never does; save it with numpy.savez")
        try:
            with archive.open(member) as stream:
                found[name] = _array(stream, at_most)
        except InputError as error:
            raise InputError(f"{name} {error}") from None
        at_most -= _takes(found[name].size, found[name].dtype)
    return found


def _array(stream: _Stream, at_most: int) -> Shaped[np.ndarray, "*d"]:
    """The array behind a header of NumPy's; memory is taken as its content comes."""
    shape, fortran, dtype = _header(stream)
    if dtype.kind not in "biuf" or dtype.itemsize > 8:
        raise InputError(f"holds {dtype}; expected numbers of up to 64 bits")
    # Long numbers are refused before they are multiplied.
    if len(shape) > _MOST_SIDES or not all(type(side) is int and 0 <= side < 2**63 for side in shape):
        raise InputError(f"says that its shape is {briefly(shape)}")
    count = math.prod(shape)
    if _takes(count, dtype) > at_most:
        raise InputError(
            f"says that its shape is {shape} ({dtype}), {_takes(count, dtype) / 1e6:.0f} MB; "
            f"expected at most {at_most / 1e6:.0f} MB"
        )
    # Untouched memory costs nothing: a header may say more than there is.
    array = np.empty(count, dtype)
    _fill(stream, array.view(np.uint8))
    shaped = array.reshape(shape[::-1]).T if fortran else array.reshape(shape)
    return np.ascontiguousarray(shaped.astype(dtype.newbyteorder("="), copy=False)).reshape(shape)


def _header(stream: _Stream) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, whether columns lie together, and type, as NumPy wrote them in front of an array."""
    version = np.lib.format.read_magic(stream)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the age of a file, or of Python in it
            if version == (1, 0):
                return np.lib.format.read_array_header_1_0(stream)
            if version == (2, 0):
                return np.lib.format.read_array_header_2_0(stream)
    except (TypeError, SyntaxError, RecursionError, TokenError) as error:
        raise ValueError(f"its header is damaged: {error}") from None
    raise ValueError(f"version {version} of its format is not known")


def _fill(stream: _Stream, memory: UInt8[np.ndarray, " n"]) -> None:
    done = 0
    while done < len(memory):
        content = stream.read(min(_CHUNK, len(memory) - done))
        if not content:
            raise InputError(f"is cut short: {done} of {len(memory)} bytes are there; copy the file again")
        memory[done : done + len(content)] = np.frombuffer(content, np.uint8)
        done += len(content)


def _takes(count: int, dtype: np.dtype) -> int:
    """Bytes of numbers; short ones become numbers of four bytes."""
    return count * max(dtype.itemsize, 4)
