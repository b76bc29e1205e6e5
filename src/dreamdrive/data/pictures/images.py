"""Frames as they come out of files, before sizing and undistortion, and folders of images."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from dreamdrive.data.companions import frames_among
from dreamdrive.data.frames.name_times import times_of_names
from dreamdrive.data.pictures.picture_file import read_pages
from dreamdrive.errors import InputError

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".avif")
UNREAD = (".heic", ".heif", ".jxl", ".dng", ".cr2", ".cr3", ".nef", ".arw")
"""Pictures of cameras that are not read, but known by their names."""


@dataclass(frozen=True)
class RawFrame:
    """One picture at its own size, turned upright, with sentences for the report.

    ``index`` is that in the source, in file or decode order, ``name`` what messages call it. ``opaque`` is
    False where the file marks a pixel as transparent, None where nothing is. The time is since frame 0 of the
    source, None where the file has no clock. A damaged frame was patched up by the decoder, or built upon one
    that was.
    """

    index: int
    name: str
    rgb: UInt8[np.ndarray, "h w 3"]
    opaque: Bool[np.ndarray, "h w"] | None = None
    time_s: float | None = None
    notes: tuple[str, ...] = ()
    damaged: bool = False

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.rgb.shape[1], self.rgb.shape[0]


@dataclass(frozen=True)
class ImageFolder:
    """The frames of one folder in natural order (2 before 10), with sentences for the report."""

    path: Path
    files: tuple[Path, ...]
    notes: tuple[str, ...] = ()

    @staticmethod
    def open(path: Path) -> "ImageFolder":
        """List the frames of a folder, not hidden files, other kinds and what lies beside frames."""
        files = sorted(_images_in(path), key=lambda f: natural_key(f.name))
        if not files:
            raise InputError(f"{path} holds no images ({', '.join(SUFFIXES)}){_hint(path)}")
        listed = frames_among(files)
        return ImageFolder(path, listed.files, listed.notes)

    def count(self) -> int:
        """Number of frames."""
        return len(self.files)

    def read(self, wanted: range) -> Iterator[RawFrame]:
        """The wanted frames, one at a time, with the times that all names tell."""
        times_s = times_of_names(self.files)
        for index in wanted:
            frame = read_image(self.files[index], index)
            yield frame if times_s is None else replace(frame, time_s=float(times_s[index]))


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Sort key under which numbers inside names compare as numbers."""
    parts = re.split(r"(\d+)", name.casefold())
    return tuple((0, int(p), p) if p.isdecimal() else (1, 0, p) for p in parts if p)


def read_image(path: Path, index: int = 0) -> RawFrame:
    """One image as 8-bit RGB, upright by its EXIF orientation.

    16-bit images are scaled by 255/65535, grey ones become RGB, and pixels less than half opaque are marked.
    """
    image, pages = read_pages(path)
    if image.dtype.name not in ("uint8", "uint16"):
        raise InputError(f"{path} holds {image.dtype} numbers; expected 8 or 16 bits a channel")
    if image.ndim == 3 and image.shape[2] not in (3, 4):
        raise InputError(f"{path} has {image.shape[2]} channels; expected grey, RGB or RGB with opacity")
    notes = ["Of images with several pages the first one is read."] if pages > 1 else []
    opaque = None
    if image.ndim == 3 and image.shape[2] == 4:
        opaque = np.ascontiguousarray(image[..., 3] >= np.iinfo(image.dtype).max / 2)
        image = image[..., :3]
    if opaque is not None and opaque.all():
        opaque = None
    if opaque is not None:
        notes.append("Transparent pixels of the images count as holding no picture.")
    if image.dtype == np.uint16:
        # Rounds as integers would: 255/65535 is 1/257, and no 16-bit number lies half way.
        image = np.asarray(cv2.convertScaleAbs(np.ascontiguousarray(image), alpha=1 / 257))
        notes.append("The 16-bit images are scaled to 8 bits, 65535 becoming 255.")
    if image.ndim == 2:
        notes.append("The images are grey: red, green and blue are equal.")
        rgb = np.repeat(image[..., None], 3, axis=2)
    else:
        rgb = np.ascontiguousarray(image[..., ::-1])
    return RawFrame(index, path.name, rgb, opaque, None, tuple(notes))


def _images_in(path: Path) -> list[Path]:
    return [f for f in path.iterdir() if f.suffix.lower() in SUFFIXES and f.name[0] != "." and f.is_file()]


def _hint(path: Path) -> str:
    """What the user may have meant instead."""
    unread = [f.name for f in sorted(path.iterdir()) if f.suffix.lower() in UNREAD]
    if unread:
        return f"; {unread[0]} is of a kind that is not read: save such pictures as JPEG or PNG"
    folders = [f.name for f in sorted(path.iterdir()) if f.is_dir() and _images_in(f)]
    videos = [f.name for f in sorted(path.iterdir()) if f.suffix.lower() in (".mp4", ".mov", ".mkv", ".avi")]
    found = [*folders[:6], *videos[:6]]
    return f"; did you mean one of these in it: {', '.join(found)}?" if found else ""
