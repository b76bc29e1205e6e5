"""A folder of images as a source of frames."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Shaped, UInt8

from dreamdrive.data.frame import RawFrame
from dreamdrive.errors import InputError

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")


@dataclass(frozen=True)
class ImageFolder:
    """The images of one folder in natural order (2 before 10).

    Attributes:
        path: The folder.
        files: Its images.
    """

    path: Path
    files: tuple[Path, ...]

    @staticmethod
    def open(path: Path) -> "ImageFolder":
        """List the images of a folder; hidden files and other kinds are left alone.

        Raises:
            InputError: There are none.
        """
        files = tuple(sorted(_images_in(path), key=lambda f: natural_key(f.name)))
        if not files:
            raise InputError(f"{path} holds no images ({', '.join(SUFFIXES)}){_hint(path)}")
        return ImageFolder(path, files)

    def count(self) -> int:
        """Number of frames."""
        return len(self.files)

    def read(self, wanted: range) -> Iterator[RawFrame]:
        """The wanted frames, one at a time.

        Raises:
            InputError: An image is unreadable or cut short.
        """
        for index in wanted:
            yield read_image(self.files[index], index)


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Sort key under which numbers inside names compare as numbers."""
    parts = re.split(r"(\d+)", name.casefold())
    return tuple((0, int(p), p) if p.isdecimal() else (1, 0, p) for p in parts if p)


def read_image(path: Path, index: int = 0) -> RawFrame:
    """One image as 8-bit RGB, upright by its EXIF orientation.

    16-bit images are scaled by 255/65535, grey ones become RGB, and pixels less than half opaque are marked.

    Raises:
        InputError: The file is missing, empty, cut short, or no image.
    """
    data = _bytes(path)
    flags = cv2.IMREAD_ANYDEPTH | cv2.IMREAD_ANYCOLOR
    image = _decode(data, flags, path)
    raw = _decode(data, cv2.IMREAD_UNCHANGED, path) if path.suffix.lower() not in (".jpg", ".jpeg") else image
    notes: list[str] = []
    opaque = None
    if raw.ndim == 3 and raw.shape[2] == 4:
        opaque = _opaque(raw, image)
    if opaque is not None:
        notes.append("Transparent pixels of the images count as holding no picture.")
    if image.dtype == np.uint16:
        image = ((image.astype(np.uint32) * 255 + 32767) // 65535).astype(np.uint8)
        notes.append("The 16-bit images are scaled to 8 bits, 65535 becoming 255.")
    if image.dtype != np.uint8:
        raise InputError(f"{path} holds {image.dtype} numbers; expected 8 or 16 bits a channel")
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
    folders = [f.name for f in sorted(path.iterdir()) if f.is_dir() and _images_in(f)]
    videos = [f.name for f in sorted(path.iterdir()) if f.suffix.lower() in (".mp4", ".mov", ".mkv", ".avi")]
    found = [*folders[:6], *videos[:6]]
    return f"; did you mean one of these in it: {', '.join(found)}?" if found else ""


def _bytes(path: Path) -> UInt8[np.ndarray, " n"]:
    try:
        data = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from error
    if not data.size:
        raise InputError(f"{path} is empty; expected an image")
    if _cut_short(data.tobytes()):
        raise InputError(
            f"{path} is cut short: the end of the image is missing; copy it again or leave it out"
        )
    return data


def _cut_short(data: bytes) -> bool:
    """Whether a JPEG or PNG stops before its end mark; decoders would fill the rest with grey."""
    if data.startswith(b"\xff\xd8"):  # the marks cannot occur inside the entropy-coded scan between them
        return data.rfind(b"\xff\xd9") < data.rfind(b"\xff\xda")
    return data.startswith(b"\x89PNG") and b"IEND" not in data[-64:]


def _decode(data: UInt8[np.ndarray, " n"], flags: int, path: Path) -> Shaped[np.ndarray, "h w *c"]:
    try:
        image = cv2.imdecode(data, flags)
    except cv2.error as error:
        raise InputError(f"{path} cannot be read as an image: {error.err}") from error
    if image is None:  # pyright: ignore[reportUnnecessaryComparison]
        raise InputError(f"{path} cannot be read as an image; expected one of {', '.join(SUFFIXES)}")
    return np.asarray(image)


def _opaque(
    raw: Shaped[np.ndarray, "h w 4"], upright: Shaped[np.ndarray, "h2 w2 *c"]
) -> Bool[np.ndarray, "h2 w2"] | None:
    """The upright opacity mask, or ``None`` if nothing is transparent.

    OpenCV turns colour by the EXIF orientation, but never alpha: find the turn by comparing the colours.
    """
    mask = raw[..., 3] >= np.iinfo(raw.dtype).max / 2
    if mask.all():
        return None
    for mirrored in (False, True):
        for quarter in range(4):
            turned = np.rot90(raw[:, ::-1] if mirrored else raw, quarter)
            if turned.shape[:2] == upright.shape[:2] and (turned[..., :3] == upright[..., :3]).all():
                return np.ascontiguousarray(np.rot90(mask[:, ::-1] if mirrored else mask, quarter))
    raise ValueError("the colours of an image depend on how its alpha is read")
