"""Cameras as files describe them: with a lens, or as pinholes that count pixels by integer index."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import msgspec
import numpy as np
from jaxtyping import Int

from dreamdrive.data.cameras.distortion import Distortion, check_bend
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera


@dataclass(frozen=True)
class LensCamera:
    """A camera of a model: its pinhole, at the size of its pictures, and its lens, None for a pinhole."""

    camera: Camera
    distortion: Distortion | None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of its pictures in pixels."""
        return self.camera.width_px, self.camera.height_px

    @property
    def key(self) -> tuple[object, ...]:
        """What makes two cameras the same."""
        c = self.camera
        return (c.fx_px, c.fy_px, c.cx_px, c.cy_px, self.size, self.distortion)


def different(found: Sequence[LensCamera]) -> tuple[list[LensCamera], Int[np.ndarray, " f"]]:
    """The different ones of the cameras of all frames, and the index of each frame's own (F,)."""
    place: dict[tuple[object, ...], int] = {}
    index = [place.setdefault(each.key, len(place)) for each in found]
    return [found[index.index(row)] for row in range(len(place))], np.array(index, np.intp)


def lens_camera(numbers: Mapping[str, float], size: tuple[int, int], fisheye: bool, where: str) -> LensCamera:
    """The camera of numbers called fx, fy, cx, cy, k1 to k6, p1, p2; pixel centres at +0.5."""
    if not all(map(isfinite, numbers.values())):
        raise InputError(f"{where}: the intrinsics hold NaN or infinite numbers")
    check_bend([numbers[key] for key in numbers if key[0] in "kp"], where)
    try:
        camera = Camera(numbers["fx"], numbers["fy"], numbers["cx"], numbers["cy"], *size)
    except ValueError as error:
        raise InputError(f"{where}: {error}") from error
    order = "k1 k2 k3 k4" if fisheye else "k1 k2 p1 p2 k3 k4 k5 k6"
    bend = tuple(numbers.get(key, 0.0) for key in order.split())
    if fisheye:  # equidistant: bent even with all coefficients 0
        return LensCamera(camera, Distortion("fisheye", bend))
    length = 8 if any(bend[5:]) else 5 if bend[4] else 4
    return LensCamera(camera, Distortion("opencv", bend[:length]) if any(bend) else None)


class Intrinsics(msgspec.Struct):
    """Focal lengths and principal point in pixels, the centre of the first pixel at 0."""

    fx: float
    fy: float
    cx: float
    cy: float


def indexed_pinhole(camera: Camera) -> dict[str, Any]:
    """What ``IndexedPinhole`` reads, and ``--intrinsics``."""
    numbers = {"fx": camera.fx_px, "fy": camera.fy_px, "cx": camera.cx_px - 0.5, "cy": camera.cy_px - 0.5}
    return {"width": camera.width_px, "height": camera.height_px, "intrinsics": numbers}


class IndexedPinhole(msgspec.Struct):
    """A calibration that counts pixels by integer index."""

    width: int
    height: int
    intrinsics: Intrinsics

    def camera(self) -> Camera:
        """The pinhole as we count, the centre of the first pixel at 0.5; ``ValueError`` if it is none."""
        k = self.intrinsics
        return Camera(k.fx, k.fy, k.cx + 0.5, k.cy + 0.5, self.width, self.height)
