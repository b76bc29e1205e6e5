"""A pack: folders in one file, small enough to be carried to a machine that is lent for minutes.

Pictures may be packed as WebP and come out as the JPEG that a set of samples holds; all else stays as it is.
"""

import io
import json
import tarfile
import zipfile
from collections.abc import Mapping
from itertools import groupby
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import UInt8

from dreamdrive.errors import InputError
from dreamdrive.files.output import new_file, new_folder

MOST_BYTES = 24_000_000
"""Of a pack, unless told."""
QUALITIES = (None, 90, 85, 80, 75, 70, 65, 60, 50, 40, 30)
"""Of WebP, from pictures as they are; the first with which a pack is small enough is taken."""
PACKAGES = "packages"
"""Folder of a pack with Python packages that the machine lacks; ``tar`` takes it out before Python begins."""
_ABOUT = "pack.json"
_PICTURE, _JPEG = ".jpg", 95


def packed(folders: Mapping[str, Path], about: Mapping[str, Any], quality: int | None = None) -> bytes:
    """A pack of folders by their names.

    Args:
        folders: All their files go in but hidden ones.
        about: What ``unpack`` returns, beside the quality.
        quality: Of the WebP that JPEGs become, from 1 to 100; None leaves them as they are.
    """
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:xz") as archive:
        _add(archive, _ABOUT, json.dumps({**about, "quality": quality}).encode())
        for name, folder in folders.items():
            for file in sorted(each for each in folder.rglob("[!.]*") if each.is_file()):
                content = file.read_bytes()
                if quality is not None and file.suffix == _PICTURE:
                    content = _encoded(_decoded(content), ".webp", cv2.IMWRITE_WEBP_QUALITY, quality)
                _add(archive, f"{name}/{file.relative_to(folder).as_posix()}", content)
    return buffer.getvalue()


def save_pack(
    path: Path, folders: Mapping[str, Path], about: Mapping[str, Any], most_bytes: int = MOST_BYTES
) -> tuple[int, int | None]:
    """Write a pack with the best pictures that it has room for; its bytes, and the quality.

    Raises:
        InputError: With the worst it is larger than may be carried.
    """
    pack = b""
    for quality in QUALITIES:
        pack = packed(folders, about, quality)
        if len(pack) <= most_bytes:
            with new_file(path) as partial:
                partial.write_bytes(pack)
            return len(pack), quality
    raise InputError(f"{path} would take {len(pack) / 1e6:.1f} MB; expected {most_bytes / 1e6:g} at most")


def with_packages(wheels: Path | None, scratch: Path) -> dict[str, Path]:
    """What a pack has of a folder of wheels, unpacked in a folder: xz makes them half as large."""
    if wheels is None:
        return {}
    for wheel in sorted(wheels.glob("*.whl")):
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(scratch / PACKAGES)
    if not (scratch / PACKAGES).is_dir():
        raise InputError(f"--wheels {wheels}: no wheels are there")
    return {PACKAGES: scratch / PACKAGES}


def unpack(path: Path, folder: Path) -> dict[str, Any]:
    """Lay the folders of a pack into a folder, but those that are there already; what it says of itself."""
    with tarfile.open(path, mode="r:xz") as archive:
        about = json.loads(_content(archive, archive.next()))
        for name, members in groupby(archive, lambda member: member.name.partition("/")[0]):
            if name in (_ABOUT, PACKAGES) or (folder / name).is_dir():
                continue
            with new_folder(folder / name, replace=False, kind="packed folder") as made:
                for member in members:
                    file = made / tarfile.data_filter(member, str(made)).name.partition("/")[2]
                    file.parent.mkdir(parents=True, exist_ok=True)
                    content = _content(archive, member)
                    if about["quality"] is not None and file.suffix == _PICTURE:
                        content = _as_jpeg(_decoded(content))
                    file.write_bytes(content)
    return about


def as_carried(rgb: UInt8[np.ndarray, "h w 3"], quality: int) -> UInt8[np.ndarray, "h w 3"]:
    """What a pack leaves of a picture that was written as JPEG before."""
    kept = _decoded(_as_jpeg(rgb[..., ::-1]))
    return _decoded(_encoded(kept, ".webp", cv2.IMWRITE_WEBP_QUALITY, quality))[..., ::-1]


def _as_jpeg(bgr: UInt8[np.ndarray, "h w 3"]) -> bytes:
    return _encoded(bgr, ".jpg", cv2.IMWRITE_JPEG_QUALITY, _JPEG)


def _encoded(bgr: UInt8[np.ndarray, "h w 3"], kind: str, flag: int, quality: int) -> bytes:
    return cv2.imencode(kind, np.ascontiguousarray(bgr), [flag, quality])[1].tobytes()


def _decoded(content: bytes) -> UInt8[np.ndarray, "h w 3"]:
    return np.asarray(cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR))


def _add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    member = tarfile.TarInfo(name)
    member.size = len(content)
    archive.addfile(member, io.BytesIO(content))


def _content(archive: tarfile.TarFile, member: tarfile.TarInfo | None) -> bytes:
    file = None if member is None else archive.extractfile(member)
    if file is None:
        raise InputError("a pack holds something that is no file; expected one of `training --make`")
    return file.read()
