"""EXIF of a photo: its focal length and where it was taken."""

import struct
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from math import hypot, isfinite
from pathlib import Path
from typing import Any

from PIL import Image

PILLOW_RAISES = (
    *(OSError, ValueError, TypeError, AttributeError, LookupError, ArithmeticError),
    *(RuntimeError, EOFError, SyntaxError, struct.error, Image.DecompressionBombError),
)
"""What Pillow raises on damaged pictures, and on what is damaged in what they say of themselves."""
_CAMERA, _PLACE = 0x8769, 0x8825
_FOCAL_35 = 0xA405
_FILM_MM = hypot(36.0, 24.0)
_LEAST_MM, _MOST_MM = 5.0, 800.0


@dataclass(frozen=True)
class PhotoFacts:
    """Each is None where the photo does not tell.

    Attributes:
        focal_35_mm: Focal length on film of 36 x 24 mm with the same field of view along the diagonal.
        latitude_deg: Of the place, north positive.
        longitude_deg: Of the place, east positive.
        heading_deg: Of the camera, from the north to the right.
    """

    focal_35_mm: float | None = None
    latitude_deg: float | None = None
    longitude_deg: float | None = None
    heading_deg: float | None = None

    def focal_px(self, size: tuple[int, int]) -> float | None:
        """The focal length in a picture of that width and height that nothing was cut from."""
        return None if self.focal_35_mm is None else self.focal_35_mm / _FILM_MM * hypot(*size)


@contextmanager
def quiet_pillow() -> Generator[None, None, None]:
    """Pillow without its warnings of what is damaged or large, which no caller can act on."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def read_exif(path: Path) -> PhotoFacts:
    """Read what is there; a photo without such data, or with what means nothing, tells nothing."""
    try:
        with quiet_pillow(), Image.open(path) as image:
            told = image.getexif()
            camera, place = told.get_ifd(_CAMERA), told.get_ifd(_PLACE)
    except PILLOW_RAISES:
        return PhotoFacts()
    focal = _number(camera.get(_FOCAL_35))
    return PhotoFacts(
        focal if focal is not None and _LEAST_MM <= focal <= _MOST_MM else None,
        _angle(place.get(2), place.get(1), "S", 90.0),
        _angle(place.get(4), place.get(3), "W", 180.0),
        _number(place.get(17)),
    )


def _number(value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if isfinite(number) else None


def _angle(parts: Any, side: Any, negative: str, most: float) -> float | None:
    """Degrees, minutes and seconds as degrees."""
    if not isinstance(parts, tuple | list) or len(parts) != 3:
        return None
    numbers = [_number(part) for part in parts]
    if any(number is None for number in numbers):
        return None
    degrees, minutes, seconds = (number or 0.0 for number in numbers)
    angle = degrees + minutes / 60 + seconds / 3600
    return None if angle > most else -angle if side == negative else angle
