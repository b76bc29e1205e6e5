"""Whether COLMAP's binary files are whole.

pycolmap believes the counts in them: a file that is cut short is read as if the rest were zeros, and a wrong
count keeps it busy for minutes.
"""

import struct
from pathlib import Path

from dreamdrive.errors import InputError

_COUNT = struct.Struct("<Q")
_CAMERA_BYTES, _RIG_BYTES = 24 + 3 * 8, 8
_IMAGE_BYTES, _POINT2D_BYTES = 4 + 7 * 8 + 4, 24
_POINT3D_BYTES, _TRACK_BYTES = 8 + 3 * 8 + 3 + 8, 8


def check_binary(folder: Path) -> None:
    """Walk over the files by the counts in them.

    Raises:
        InputError: A file is shorter or longer than it says.
    """
    for name in ("cameras.bin", "images.bin", "points3D.bin", "rigs.bin", "frames.bin"):
        path = folder / name
        if path.is_file() and not _whole(name, path.read_bytes()):
            raise InputError(
                f"{path}: the COLMAP model is damaged (its length is not what it says); copy it again"
            )


def _whole(name: str, data: bytes) -> bool:
    if len(data) < _COUNT.size:
        return False
    (count,) = _COUNT.unpack_from(data)
    try:
        if name == "images.bin":
            return _after_images(data, count) == len(data)
        if name == "points3D.bin":
            return _after_points(data, count) == len(data)
    except (struct.error, ValueError, OverflowError):
        return False
    return _COUNT.size + count * (_CAMERA_BYTES if name == "cameras.bin" else _RIG_BYTES) <= len(data)


def _after_images(data: bytes, count: int) -> int:
    place = _COUNT.size
    for _ in range(count):
        place = data.index(b"\0", place + _IMAGE_BYTES) + 1
        place += _COUNT.size + _POINT2D_BYTES * _COUNT.unpack_from(data, place)[0]
    return place


def _after_points(data: bytes, count: int) -> int:
    place = _COUNT.size
    for _ in range(count):
        place += _POINT3D_BYTES
        place += _COUNT.size + _TRACK_BYTES * _COUNT.unpack_from(data, place)[0]
    return place
