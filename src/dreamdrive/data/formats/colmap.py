"""COLMAP's sparse models, binary or text.

COLMAP writes camera_from_world with x right, y down, z forward, as we do, and counts pixels from the corner
of the picture (the first pixel's centre is 0.5), as we do. The unit of a model is arbitrary.

pycolmap believes the counts in binary files: one that is cut short is read as if the rest were zeros, and a
wrong count keeps it busy for minutes. So their lengths are checked first.
"""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dreamdrive.data.formats.cameras import LensCamera, lens_camera
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes

_MODELS = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": "fx fy cx cy",
    "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2",
    "OPENCV": "fx fy cx cy k1 k2 p1 p2",
    "FULL_OPENCV": "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
    "OPENCV_FISHEYE": "fx fy cx cy k1 k2 k3 k4",
    "SIMPLE_RADIAL_FISHEYE": "f cx cy k1",
    "RADIAL_FISHEYE": "f cx cy k1 k2",
}
"""What COLMAP's numbers mean, by its model."""
_FILES = ("cameras", "images", "points3D")
_ENDINGS = (".bin", ".txt")
_MOST_BYTES = 2_000_000_000
_PARAMETERS = (3, 4, 4, 5, 8, 8, 12, 5, 4, 5, 12, 16, 4, 5, 3, 4, 6, 2)
"""How many numbers each camera model has, by its number."""


def find_colmap(folder: Path) -> Path | None:
    """The folder of a COLMAP model: this one, or where COLMAP and nerfstudio put it inside a project."""
    for inner in (".", "sparse/0", "sparse", "colmap/sparse/0"):
        place = folder / inner
        if any((place / f"{name}{ending}").is_file() for name in _FILES for ending in _ENDINGS):
            return place
    return None


def read_colmap(folder: Path) -> Any:
    """Read a COLMAP model, binary or text, as ``pycolmap.Reconstruction``; of both the binary one."""
    import pycolmap  # here: reading a clip without such a model should not wait for it

    missing = {
        ending: [f"{name}{ending}" for name in _FILES if not (folder / f"{name}{ending}").is_file()]
        for ending in _ENDINGS
    }
    ending = min(missing, key=lambda each: len(missing[each]))
    if missing[ending]:
        raise InputError(
            f"{folder}: {', '.join(missing[ending])} is missing; a COLMAP model is cameras, images and "
            "points3D, all .bin or all .txt"
        )
    for name, after in _AFTER.items() if ending == ".bin" else ():
        path = folder / f"{name}.bin"
        if path.is_file() and not _whole(read_bytes(path, at_most=_MOST_BYTES), after):
            raise InputError(
                f"{path}: the COLMAP model is damaged (its length is not what it says); copy it again"
            )
    model = pycolmap.Reconstruction()
    try:
        (model.read_binary if ending == ".bin" else model.read_text)(str(folder))
        for image in model.images.values():
            str(image.name)  # which it decodes here
    except (ValueError, IndexError, KeyError, RuntimeError, MemoryError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{folder}: the COLMAP model is damaged ({reason}); export it again") from error
    return model


def colmap_camera(camera: Any, where: str) -> LensCamera:
    """A ``pycolmap.Camera`` of a COLMAP model."""
    name = camera.model.name
    if name not in _MODELS:
        raise InputError(
            f"{where}: camera model {name} is not known; expected {', '.join(_MODELS)}: undistort the "
            "pictures with `colmap image_undistorter` and give these and their model"
        )
    values = dict(zip(_MODELS[name].split(), map(float, camera.params), strict=True))
    if "f" in values:
        values["fx"] = values["fy"] = values["f"]
    return lens_camera(values, (camera.width, camera.height), "FISHEYE" in name, where)


def _whole(data: bytes, after: Callable[[bytes, int], int]) -> bool:
    """Whether as many entries as the first number says fill the file; each is at least a byte long."""
    try:
        place = 8
        for _ in range(_count("<Q", data, 0)):
            place = after(data, place)
    except (struct.error, ValueError, IndexError, OverflowError):
        return False
    return place == len(data)


def _count(kind: str, data: bytes, place: int) -> int:
    return struct.unpack_from(kind, data, place)[0]


def _after_camera(data: bytes, place: int) -> int:
    model = _count("<i", data, place + 4)
    if model < 0:
        raise ValueError(f"no camera model has the number {model}")
    return place + 24 + 8 * _PARAMETERS[model]


def _after_image(data: bytes, place: int) -> int:
    """Number, pose (7) and camera; name; its points: place (2) and number."""
    place = data.index(b"\0", place + 4 + 7 * 8 + 4) + 1
    return place + 8 + 24 * _count("<Q", data, place)


def _after_point(data: bytes, place: int) -> int:
    """Number, place (3), colour (3) and error; its track: image and point."""
    place += 8 + 3 * 8 + 3 + 8
    return place + 8 + 8 * _count("<Q", data, place)


def _after_rig(data: bytes, place: int) -> int:
    """A rig names its first sensor; each other one may have a pose (7)."""
    sensors = _count("<I", data, place + 4)
    place += 8 + (8 if sensors else 0)
    for _ in range(sensors - 1):
        place += 8
        place += 1 + (7 * 8 if data[place] else 0)
    return place


def _after_frame(data: bytes, place: int) -> int:
    """Number, rig and pose (7); its data: sensor (2) and number."""
    place += 8 + 7 * 8
    return place + 4 + 16 * _count("<I", data, place)


_AFTER = {
    "cameras": _after_camera,
    "images": _after_image,
    "points3D": _after_point,
    "rigs": _after_rig,
    "frames": _after_frame,
}
