"""Formats of geometry files, told by their content."""

from collections.abc import Callable
from pathlib import Path

from dreamdrive.data.cameras.intrinsics import model_cameras
from dreamdrive.data.formats.colmap import find_colmap
from dreamdrive.data.formats.nerfstudio import depth_file, transforms_frames
from dreamdrive.errors import InputError
from dreamdrive.files.given import WANTED
from dreamdrive.files.json_file import read_json
from dreamdrive.files.paths import open_file
from dreamdrive.geometry.backends.files.given import NAME, OPTION, FileGeometry
from dreamdrive.geometry.backends.files.readers import (
    CALIBRATION,
    read_colmap_model,
    read_pandaset,
    read_plain,
    read_pose_list,
    read_transforms,
)
from dreamdrive.geometry.backends.files.wanted import Wanted

EXPECTED = WANTED["geometry-files"]
_FILES = ("cameras.json", "transforms.json", "poses.txt")

Reader = Callable[[Path, Wanted], FileGeometry]


def recognise(path: Path) -> tuple[Reader, Path]:
    """The reader of the format that lies at ``path``, and what it reads: a file, or a folder for COLMAP."""
    if path.is_dir():
        found = [path / name for name in _FILES if (path / name).is_file()]
        model = find_colmap(path)
        if len(found) > 1 or (found and model == path):
            names = [each.name for each in found] + (["a COLMAP model"] if model == path else [])
            raise InputError(f"{OPTION} {path} holds {' and '.join(names)}; name the file that is meant")
        if found:
            return recognise(found[0])
        if model is not None:
            return read_colmap_model, path
        raise InputError(f"{OPTION} {path} cannot be read: expected in it {EXPECTED}")
    if not path.is_file():
        raise InputError(f"{OPTION} {path} does not exist; expected {EXPECTED}")
    if path.suffix.lower() == ".bin" or path.name in ("cameras.txt", "images.txt", "points3D.txt"):
        raise InputError(f"{OPTION} {path} is part of a COLMAP model; give its folder, {path.parent}")
    return (_of_json(path) if _is_json(path) else read_pose_list), path


def _is_json(path: Path) -> bool:
    with open_file(path, f"{OPTION} {path}") as file:
        return path.suffix.lower() == ".json" or file.read(64).lstrip()[:1] in (b"{", b"[")


def _of_json(path: Path) -> Reader:
    record = read_json(path, OPTION)
    if isinstance(record.get("cameras"), dict):
        return read_pandaset
    if "world_from_camera" in record:
        return read_pose_list if "times_s" in record and "intrinsics" not in record else read_plain
    return read_transforms if "frames" in record else read_plain


def bent_model(path: Path) -> Path | None:
    """What to give as ``--intrinsics`` so that the frames are read without the distortion of these files.

    ``None`` where the cameras of ``path`` are pinholes, or where it has none.

    Raises:
        InputError: The cameras cannot be read.
    """
    if not path.exists():
        return None
    reader, place = recognise(path)
    if reader not in (read_colmap_model, read_transforms):
        return None
    cameras = model_cameras(place, OPTION) or []
    return place if any(each.distortion is not None for each in cameras) else None


def companions(path: Path) -> list[Path]:
    """What else decides over the geometry: files beside a file, and depth that a ``transforms.json`` names.

    Raises:
        InputError: ``path`` holds nothing that is known.
    """
    reader, place = recognise(path)
    named: list[Path] = []
    if reader is read_transforms:
        frames = transforms_frames(read_json(place, OPTION), str(place))
        named = [file for frame in frames if (file := depth_file(place, frame)) is not None]
    if path.is_file():
        named += [path.parent / NAME, path.parent / CALIBRATION, path.parent / "depth"]
    return sorted({each for each in named if each.exists()})
