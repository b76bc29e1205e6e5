"""One picture with what is known of it, and how it is cut, turned and mirrored."""

from dataclasses import dataclass, replace
from math import cos, nan, radians

import cv2
import numpy as np
from jaxtyping import UInt8, UInt16

from dreamdrive.data.pictures.picture_file import read_picture
from dreamdrive.errors import InputError
from dreamdrive.files.paths import inside
from dreamdrive_train.street_network.data.mixture import Entry
from dreamdrive_train.street_network.data.records import UNKNOWN

STRIDE = 2
"""Pixels of the picture along each side of a place of its targets."""


@dataclass(frozen=True)
class Picture:
    """A picture and its truth; what is not known of the camera is not a number.

    Attributes:
        rgb: The picture.
        labels: See ``LABEL_SETS``; (H, W), or at ``STRIDE`` after ``cut``.
        instances: Of road users from 1; 0 none, 255 not known.
        depth: As in a record's picture of depth.
        focal: Focal length in widths.
        horizon: In widths, counted as in ``Record``.
        roll_rad: As in ``Record``.
        camera_height_m: Height of the camera above the road.
        distorted: 1 of a strongly distorting lens, 0 of another.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    labels: UInt8[np.ndarray, "h2 w2"]
    instances: UInt8[np.ndarray, "h2 w2"]
    depth: UInt16[np.ndarray, "h2 w2"]
    focal: float
    horizon: float
    roll_rad: float
    camera_height_m: float
    distorted: float

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture."""
        return self.rgb.shape[1], self.rgb.shape[0]


def read_entry(entry: Entry) -> Picture:
    """The picture of a record, with nothing known where it has no files."""
    record = entry.record
    rgb = read_picture(inside(entry.folder, record.image))
    if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[2] != 3:
        raise InputError(f"{entry.folder / record.image} is no 8-bit picture in colour")
    height, width = rgb.shape[:2]
    labels = np.full((height, width), UNKNOWN, np.uint8)
    instances, depth = labels, np.zeros((height, width), np.uint16)
    if record.labels is not None:
        read = read_picture(inside(entry.folder, record.labels))
        _check(entry, record.labels, read, np.uint8, (height, width, 3))
        instances, labels = np.ascontiguousarray(read[..., 1]), np.ascontiguousarray(read[..., 2])
    if record.depth is not None:
        depth = read_picture(inside(entry.folder, record.depth))
        _check(entry, record.depth, depth, np.uint16, (height, width))

    def known(value: float | None) -> float:
        return nan if value is None else float(value)

    return Picture(
        rgb=cv2.cvtColor(rgb, cv2.COLOR_BGR2RGB),
        labels=labels,
        instances=instances,
        depth=depth,
        focal=known(record.focal_px) / width,
        horizon=known(record.horizon_px) / width,
        roll_rad=known(record.roll_rad),
        camera_height_m=known(record.camera_height_m),
        distorted=known(record.distorted),
    )


def cut(picture: Picture, box: tuple[float, float, float, float], size: tuple[int, int]) -> Picture:
    """A part (left, top, width, height in pixels) at a new size, its truth at ``STRIDE``.

    The box has the shape of the size; the camera stays known only about the middle of the picture.
    """
    width, height = picture.size
    left, top = (min(max(round(at), 0), most - 1) for at, most in zip(box, (width, height), strict=False))
    right, bottom = min(left + max(round(box[2]), 1), width), min(top + max(round(box[3]), 1), height)
    part = slice(top, bottom), slice(left, right)
    small = size[0] // STRIDE, size[1] // STRIDE
    rule = cv2.INTER_AREA if right - left > size[0] else cv2.INTER_LINEAR

    def nearest(values: np.ndarray) -> np.ndarray:
        return cv2.resize(values[part], small, interpolation=cv2.INTER_NEAREST_EXACT)

    cut_from = width / (right - left)
    return replace(
        picture,
        rgb=cv2.resize(picture.rgb[part], size, interpolation=rule),
        labels=nearest(picture.labels),
        instances=nearest(picture.instances),
        depth=nearest(picture.depth),
        focal=picture.focal * cut_from,
        horizon=picture.horizon * cut_from,
    )


def centred(picture: Picture, size: tuple[int, int], share: float = 1.0) -> Picture:
    """The largest part of the shape of a size about the middle, or a share of it along each side."""
    across, down = largest(picture.size, size)
    across, down = across * share, down * share
    width, height = picture.size
    return cut(picture, ((width - across) / 2, (height - down) / 2, across, down), size)


def continued(picture: Picture, shape: tuple[int, int], most: float) -> Picture:
    """With the outermost rows repeated above and below until the picture is as high as a shape asks.

    Nothing is known of these rows, and they are no larger share of the new height than ``most``.
    """
    width, height = picture.size
    rows = min(width * shape[1] / shape[0], height / (1 - most)) - height
    rows = max(0, round(rows / 2))
    unknown = {"labels": UNKNOWN, "instances": UNKNOWN, "depth": 0}
    maps = {
        name: cv2.copyMakeBorder(
            getattr(picture, name), rows, rows, 0, 0, cv2.BORDER_CONSTANT, value=float(value)
        )
        for name, value in unknown.items()
    }
    rgb = cv2.copyMakeBorder(picture.rgb, rows, rows, 0, 0, cv2.BORDER_REPLICATE)
    return replace(picture, rgb=rgb, **maps)


def largest(within: tuple[int, int], shape: tuple[int, int]) -> tuple[float, float]:
    """Width and height of the largest box of a shape inside a size."""
    across = min(within[0], within[1] * shape[0] / shape[1])
    return across, across * shape[1] / shape[0]


def camera_dropped(picture: Picture) -> Picture:
    """Without what is known of the camera."""
    unknown = dict.fromkeys(("focal", "horizon", "roll_rad", "camera_height_m", "distorted"), nan)
    return replace(picture, **unknown)


def mirrored(picture: Picture) -> Picture:
    """Left and right exchanged."""
    maps = {
        name: np.ascontiguousarray(getattr(picture, name)[:, ::-1])
        for name in ("rgb", "labels", "instances", "depth")
    }
    return replace(picture, **maps, roll_rad=-picture.roll_rad)


def turned(picture: Picture, clockwise_deg: float) -> Picture:
    """As from a camera turned clockwise about its axis, so that what it shows turns the other way.

    Nothing is known of the corners, which repeat the border.
    """
    width, height = picture.size
    turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), clockwise_deg, 1.0)

    def nearest(values: np.ndarray, outside: int) -> np.ndarray:
        return cv2.warpAffine(values, turn, (width, height), flags=cv2.INTER_NEAREST, borderValue=outside)

    roll = picture.roll_rad + radians(clockwise_deg)
    return replace(
        picture,
        rgb=cv2.warpAffine(picture.rgb, turn, (width, height), borderMode=cv2.BORDER_REPLICATE),
        labels=nearest(picture.labels, UNKNOWN),
        instances=nearest(picture.instances, UNKNOWN),
        depth=nearest(picture.depth, 0),
        # The line keeps its distance from the middle.
        horizon=picture.horizon * cos(picture.roll_rad) / cos(roll),
        roll_rad=roll,
    )


def _check(entry: Entry, name: str, read: np.ndarray, kind: type, shape: tuple[int, ...]) -> None:
    if read.dtype != kind or read.shape != shape:
        raise InputError(
            f"{entry.folder / name} holds {read.dtype} of {read.shape}; expected {np.dtype(kind)} of {shape}"
        )
