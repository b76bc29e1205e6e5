"""Pictures on disk, decoded only where their header says that they fit into memory."""

import re
import struct
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Shaped, UInt8
from PIL import Image, ImageOps

from dreamdrive.data.pictures.exif import PILLOW_RAISES, quiet_pillow
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes

MAX_PIXELS = 64_000_000
"""Pixels that a picture may have: twice as many as a frame of 8K video, 0.2 GB."""
PICTURE_BYTES = 200_000_000
"""Bytes that a file of a picture may have, so that file and picture fit into memory together."""
KINDS = "PNG, JPEG, BMP, TIFF, WebP or AVIF"
_MAX_SCANS = 50
"""Scans that a JPEG may have: decoding takes as long for each. Usual are 10."""
_JPEG_SIZES = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})
"""Markers behind which a JPEG has its size; the three left out have tables."""
_JPEG_SCAN = 0xDA
_JPEG_ALONE = frozenset({0x01, *range(0xD0, 0xDA)})
"""Markers of a JPEG without content."""
_BYTES_OF = {1: 1, 3: 2, 4: 4, 16: 8}
"""Bytes of a whole number in TIFF, by its type."""
_WIDTH, _HEIGHT, _ORIENTATION = 256, 257, 274
_NEXT = -1
"""In place of a tag: where the next directory of a TIFF lies, 0 where there is none."""
_AVIF_HEAD = 100_000
"""Bytes at the start of an AVIF in which it tells its size."""


@dataclass(frozen=True)
class Header:
    """The header of a picture, with its size as stored, before turning.

    ``orientation`` is how to turn it, as EXIF counts, 1 to 8; 1 where its decoder turns it, as of a TIFF.
    ``pages`` are 2 where there are more than one.
    """

    kind: str
    width_px: int
    height_px: int
    orientation: int = 1
    pages: int = 1


def read_picture(path: Path, where: str = "") -> Shaped[np.ndarray, "h w *c"]:
    """A picture with its own depth and channels, upright: grey, or blue, green, red and perhaps alpha.

    Messages call it ``where``, or by its path. Of several pages it is the first.
    """
    return read_pages(path, where)[0]


def read_pages(path: Path, where: str = "") -> tuple[Shaped[np.ndarray, "h w *c"], int]:
    """The picture as of ``read_picture``, and its number of pages: 1, or 2 for several."""
    where = where or str(path)
    return decoded(read_bytes(path, where, at_most=PICTURE_BYTES), where)


def decoded(data: bytes, where: str) -> tuple[Shaped[np.ndarray, "h w *c"], int]:
    """The picture in a file's bytes as of ``read_picture``, and its number of pages: 1, or 2 for several."""
    if not data:
        raise InputError(f"{where} is empty; expected an image")
    if _cut_short(data):
        raise InputError(
            f"{where} is cut short: the end of the image is missing; copy it again or leave it out"
        )
    header = parse_header(data)
    if header is None or 0 in (header.width_px, header.height_px):
        raise InputError(f"{where} cannot be read as an image; expected {KINDS}")
    _check(header, data, where)
    if header.kind == "AVIF":
        return _decoded_by_pillow(data, where), header.pages
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        picture = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise InputError(f"{where} cannot be read as an image: {error.err}") from error
    finally:
        cv2.utils.logging.setLogLevel(level)
    if picture is None:  # pyright: ignore[reportUnnecessaryComparison]
        raise InputError(f"{where} cannot be read as an image; expected {KINDS}")
    return _upright(np.asarray(picture), header.orientation), header.pages


def write_picture(
    path: Path, picture: Shaped[np.ndarray, "h w *c"], *, quality: int = 95, compression: int | None = None
) -> None:
    """Write a PNG or JPEG, as the name ends, of what ``read_picture`` gives; ``OSError`` where it cannot be.

    ``quality`` is that of a JPEG, ``compression`` that of a PNG, from 0 to 9. OpenCV's own writer tells
    nobody that a disk is full.
    """
    options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    if path.suffix.lower() == ".png":
        options = [] if compression is None else [cv2.IMWRITE_PNG_COMPRESSION, compression]
    path.write_bytes(_encoded(picture, path.suffix, options))


def kept_frame(rgb: UInt8[np.ndarray, "h w 3"]) -> bytes:
    """A recorded frame as it is kept with a scene: a JPEG; the same frame gives the same bytes."""
    return _encoded(rgb[..., ::-1], ".jpg", [cv2.IMWRITE_JPEG_QUALITY, 95])


def frame_of(kept: bytes, size: tuple[int, int]) -> UInt8[np.ndarray, "h w 3"]:
    """The RGB of a frame that was kept, of a width and height; ``InputError`` where it is none."""
    header = parse_header(kept)
    if header is None or (header.kind, header.width_px, header.height_px) != ("JPEG", *size):
        raise InputError(f"a recorded frame is damaged: expected a JPEG of {size[0]}x{size[1]} pixels")
    picture, _ = decoded(kept, "a recorded frame")
    if picture.shape != (size[1], size[0], 3):
        raise InputError(
            f"a recorded frame is {picture.shape}; expected {size[0]}x{size[1]} pixels in colour"
        )
    return np.ascontiguousarray(picture[..., ::-1])


def _encoded(picture: Shaped[np.ndarray, "h w *c"], suffix: str, options: list[int]) -> bytes:
    return cv2.imencode(suffix, np.ascontiguousarray(picture), options)[1].tobytes()


def _decoded_by_pillow(data: bytes, where: str) -> Shaped[np.ndarray, "h w *c"]:
    """What OpenCV's wheels do not read."""
    try:
        with quiet_pillow(), Image.open(BytesIO(data), formats=("AVIF",)) as opened:
            upright = ImageOps.exif_transpose(opened)
            return np.asarray(upright.convert("RGBA" if "A" in upright.getbands() else "RGB"))[
                ..., [2, 1, 0, 3][: len(upright.getbands())]
            ]
    except PILLOW_RAISES as error:
        raise InputError(f"{where} cannot be read as an image: {error}") from error


def _check(header: Header, data: bytes, where: str) -> None:
    """Refuse what would take more memory or time than a picture should."""
    width, height = header.width_px, header.height_px
    if width * height > MAX_PIXELS:
        raise InputError(
            f"{where} is an image of {width}x{height} pixels; expected at most {MAX_PIXELS // 10**6} "
            "megapixels: scale it down"
        )
    if header.kind == "JPEG" and (scans := data.count(b"\xff\xda")) > _MAX_SCANS:
        raise InputError(
            f"{where} is a JPEG of {scans} scans; expected at most {_MAX_SCANS}: save it again with another "
            "program"
        )


def _cut_short(data: bytes) -> bool:
    """Whether a JPEG or PNG stops before its end mark; decoders would fill the rest with grey."""
    if data.startswith(b"\xff\xd8"):  # the marks cannot occur inside the entropy-coded scan between them
        return data.rfind(b"\xff\xd9") < data.rfind(b"\xff\xda")
    return data.startswith(b"\x89PNG") and b"IEND" not in data[-64:]


def _upright(picture: Shaped[np.ndarray, "h w *c"], orientation: int) -> Shaped[np.ndarray, "h2 w2 *c"]:
    """The picture as EXIF asks to show it."""
    mirrored = orientation in (2, 4, 5, 7)
    quarters = {1: 0, 2: 0, 3: 2, 4: 2, 5: 1, 6: 3, 7: 3, 8: 1}[orientation]
    return np.rot90(picture[:, ::-1] if mirrored else picture, quarters)


def parse_header(data: bytes) -> Header | None:
    """The header of a picture, the largest size where it has several; None if it has none or is cut short."""
    try:
        if data[:8] == b"\x89PNG\r\n\x1a\n":
            return _png(data)
        if data[:2] == b"\xff\xd8":
            return _jpeg(data)
        if data[:2] == b"BM":
            return _bmp(data)
        if data[:4] in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
            tags = _tags(data)
            size = max(tags.get(_WIDTH, [0])), max(tags.get(_HEIGHT, [0]))
            return Header("TIFF", *size, pages=2 if tags.get(_NEXT, [0])[0] else 1)
        if data[4:12] in (b"ftypavif", b"ftypavis"):
            return _avif(data)
        if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
            return _webp(data)
    except struct.error:
        return None
    return None


def _png(data: bytes) -> Header | None:
    if data[12:16] != b"IHDR":
        return None
    width, height = struct.unpack_from(">II", data, 16)
    place, orientation, kind, pages = 8, 1, b"", 1
    while kind != b"IEND":
        length, kind = struct.unpack_from(">I4s", data, place)
        if kind == b"eXIf":
            orientation = _turn(data[place + 8 : place + 8 + length])
        pages = 2 if kind == b"acTL" else pages
        place += 12 + length
        # OpenCV takes memory for what a part says that it holds.
        if place > len(data):
            return None
    return Header("PNG", width, height, orientation, pages)


def _jpeg(data: bytes) -> Header | None:
    width, height, orientation, place = 0, 0, 1, 2
    while True:
        place = data.find(b"\xff", place)
        while data[place : place + 2] == b"\xff\xff":
            place += 1
        marker = data[place + 1] if 0 <= place < len(data) - 1 else _JPEG_SCAN
        if marker == _JPEG_SCAN:
            return Header("JPEG", width, height, orientation)
        place += 2
        if marker in _JPEG_ALONE:
            continue
        (length,) = struct.unpack_from(">H", data, place)
        if marker in _JPEG_SIZES:
            rows, columns = struct.unpack_from(">HH", data, place + 3)
            width, height = max(width, columns), max(height, rows)
        elif marker == 0xE1 and data[place + 2 : place + 8] == b"Exif\0\0" and orientation == 1:
            orientation = _turn(data[place + 8 : place + length])
        place += max(length, 2)


def _bmp(data: bytes) -> Header:
    (size,) = struct.unpack_from("<I", data, 14)
    width, height = struct.unpack_from("<HH" if size == 12 else "<ii", data, 18)
    return Header("BMP", abs(width), abs(height))


def _webp(data: bytes) -> Header | None:
    kind = data[12:16]
    if kind == b"VP8 ":
        width, height = struct.unpack_from("<HH", data, 26)
        return Header("WebP", width & 0x3FFF, height & 0x3FFF)
    if kind == b"VP8L":
        (bits,) = struct.unpack_from("<I", data, 21)
        return Header("WebP", (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1)
    if kind != b"VP8X" or len(data) < 30:
        return None
    width, height = (int.from_bytes(data[place : place + 3], "little") + 1 for place in (24, 27))
    place, orientation, pages = 12, 1, 1
    while place + 8 <= len(data):
        name, length = struct.unpack_from("<4sI", data, place)
        if name == b"EXIF":
            orientation = _turn(data[place + 8 : place + 8 + length].removeprefix(b"Exif\0\0"))
        pages = 2 if name == b"ANIM" else pages
        place += 8 + length + length % 2
    return Header("WebP", width, height, orientation, pages)


def _avif(data: bytes) -> Header | None:
    """By the boxes that tell an image's extent; a grid of tiles has one for the whole, the largest."""
    extents = [
        struct.unpack_from(">II", data, at.end() + 4) for at in re.finditer(b"ispe", data[:_AVIF_HEAD])
    ]
    if not extents:
        return None
    width, height = max(extents, key=lambda extent: extent[0] * extent[1])
    return Header("AVIF", width, height, pages=2 if data[8:12] == b"avis" else 1)


def _turn(exif: bytes) -> int:
    """Orientation in a block of EXIF; 1, upright, where it says nothing usable."""
    try:
        found = _tags(exif).get(_ORIENTATION, [1])[0]
    except struct.error:
        return 1
    return found if 1 <= found <= 8 else 1


def _tags(data: bytes) -> dict[int, list[int]]:
    """Whole numbers by tag in the first directory of a TIFF, which EXIF is too; a tag may repeat."""
    order = "<" if data[:2] == b"II" else ">"
    big = data[2:4] in (b"+\0", b"\0+")
    # BigTIFF has eight bytes where TIFF has four, and counts its entries with eight instead of two.
    (place,) = struct.unpack_from(order + ("Q" if big else "I"), data, 8 if big else 4)
    (count,) = struct.unpack_from(order + ("Q" if big else "H"), data, place)
    place += 8 if big else 2
    found: dict[int, list[int]] = {}
    for entry in range(min(count, 65535)):
        at = place + entry * (20 if big else 12)
        tag, kind = struct.unpack_from(order + "HH", data, at)
        if tag in (_WIDTH, _HEIGHT, _ORIENTATION):
            at += 12 if big else 8
            value = data[at : at + _BYTES_OF.get(kind, 4)]
            found.setdefault(tag, []).append(int.from_bytes(value, "little" if order == "<" else "big"))
    end = place + count * (20 if big else 12)
    following = data[end : end + (8 if big else 4)]
    found[_NEXT] = [int.from_bytes(following, "little" if order == "<" else "big")]
    return found
