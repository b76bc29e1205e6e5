"""Pictures on disk, decoded only where their header says that they fit into memory."""

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Shaped

from dreamdrive.data.picture_header import Header, parse_header
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes

MAX_PIXELS = 64_000_000
"""Pixels that a picture may have: twice as many as a frame of 8K video, 0.2 GB."""
PICTURE_BYTES = 200_000_000
"""Bytes that a file of a picture may have, so that file and picture fit into memory together."""
KINDS = "PNG, JPEG, BMP, TIFF or WebP"
_MAX_SCANS = 50
"""Scans that a JPEG may have: decoding takes as long for each. Usual are 10."""


def read_picture(path: Path, where: str = "") -> Shaped[np.ndarray, "h w *c"]:
    """A picture with its own depth and channels, upright: grey, or blue, green, red and perhaps alpha.

    Messages call it ``where``, or by its path.
    """
    where = where or str(path)
    data = read_bytes(path, where, at_most=PICTURE_BYTES)
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
    return _upright(np.asarray(picture), header.orientation)


def write_picture(path: Path, picture: Shaped[np.ndarray, "h w *c"]) -> None:
    """Write a PNG of what ``read_picture`` gives."""
    path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())


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
