"""Whether COLMAP's binary files are whole.

pycolmap believes the counts in them: a file that is cut short is read as if the rest were zeros, and a wrong
count keeps it busy for minutes.
"""

import struct
from collections.abc import Callable
from pathlib import Path

from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes

_MOST_BYTES = 2_000_000_000
_COUNT, _SHORT, _MODEL = struct.Struct("<Q"), struct.Struct("<I"), struct.Struct("<i")
_PARAMETERS = (3, 4, 4, 5, 8, 8, 12, 5, 4, 5, 12, 16, 4, 5, 3, 4, 6, 2)
"""How many numbers each camera model has, by its number."""
_IMAGE_BYTES, _POINT2D_BYTES = 4 + 7 * 8 + 4, 24
_POINT3D_BYTES, _TRACK_BYTES = 8 + 3 * 8 + 3 + 8, 8
_SENSOR_BYTES, _POSE_BYTES, _DATA_BYTES = 8, 56, 16


def check_binary(folder: Path) -> None:
    """Walk over the files by the counts in them.

    Raises:
        InputError: A file is shorter or longer than it says.
    """
    for name, after in _AFTER.items():
        path = folder / name
        if path.is_file() and not _whole(read_bytes(path, at_most=_MOST_BYTES), after):
            raise InputError(
                f"{path}: the COLMAP model is damaged (its length is not what it says); copy it again"
            )


def _whole(data: bytes, after: Callable[[bytes, int], int]) -> bool:
    """Whether as many entries as the first number says fill the file; each is at least a byte long."""
    try:
        (count,) = _COUNT.unpack_from(data)
        place = _COUNT.size
        for _ in range(count):
            place = after(data, place)
    except (struct.error, ValueError, IndexError, OverflowError):
        return False
    return place == len(data)


def _after_camera(data: bytes, place: int) -> int:
    (model,) = _MODEL.unpack_from(data, place + 4)
    if model < 0:
        raise ValueError(f"no camera model has the number {model}")
    return place + 24 + 8 * _PARAMETERS[model]


def _after_image(data: bytes, place: int) -> int:
    place = data.index(b"\0", place + _IMAGE_BYTES) + 1
    return place + _COUNT.size + _POINT2D_BYTES * _COUNT.unpack_from(data, place)[0]


def _after_point(data: bytes, place: int) -> int:
    place += _POINT3D_BYTES
    return place + _COUNT.size + _TRACK_BYTES * _COUNT.unpack_from(data, place)[0]


def _after_rig(data: bytes, place: int) -> int:
    """A rig names its first sensor; each other one may have a pose."""
    (sensors,) = _SHORT.unpack_from(data, place + 4)
    place += 8 + (_SENSOR_BYTES if sensors else 0)
    for _ in range(sensors - 1):
        place += _SENSOR_BYTES
        place += 1 + (_POSE_BYTES if data[place] else 0)
    return place


def _after_frame(data: bytes, place: int) -> int:
    place += 8 + _POSE_BYTES
    return place + _SHORT.size + _DATA_BYTES * _SHORT.unpack_from(data, place)[0]


_AFTER = {
    "cameras.bin": _after_camera,
    "images.bin": _after_image,
    "points3D.bin": _after_point,
    "rigs.bin": _after_rig,
    "frames.bin": _after_frame,
}
