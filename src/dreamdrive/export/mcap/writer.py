"""Writer of a drive to an MCAP file while it happens."""

import math
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.errors import InputError
from dreamdrive.export.log import START_US, RigCamera
from dreamdrive.export.log_parts import NS, US
from dreamdrive.export.mcap.file import McapFile, need_foxglove
from dreamdrive.export.mcap.words import (
    BOXES,
    CAR,
    LIDAR,
    MAP,
    PATH,
    TRANSFORMS,
    RecordedBox,
    boxes_of,
    calibration_of,
    calibration_topic,
    cloud_of,
    image_of,
    image_topic,
    line_of,
    number_topic,
    transforms_of,
)
from dreamdrive.files.output import check_ending, check_new_file, new_file
from dreamdrive.scene.camera import Camera, check_rigid
from dreamdrive.scene.level import upright

SUFFIX = ".mcap"
_JPEG = 95
_NUMBER = {"title": "Number", "type": "object", "properties": {"value": {"type": "number"}}}
_LAST_S = 2**32
"""Messages have so many seconds since 1970 at most."""


def check_mcap(file: Path, replace: bool) -> None:
    """Fail before the work where a recording, of the same arguments, would.

    Raises:
        InputError: The name does not end in ``.mcap``, or something is there that is not to be replaced.
    """
    check_ending(file, SUFFIX)
    check_new_file(file, replace)


def ground_pose(x_m: float, y_m: float, yaw_rad: float, up_m: float = 0.0) -> Float[np.ndarray, "4 4"]:
    """The pose of what stands level: x ahead, y left, z up; yaw counts from x counter-clockwise."""
    pose = upright((x_m, y_m, yaw_rad))
    pose[2, 3] = up_m
    return pose


class DriveRecording:
    """One drive on its way into an MCAP file, for Foxglove and other readers.

    It is to be used in a ``with`` block. The file appears when the block ends, and only if it ends well;
    until then an older file stays as it is. Memory holds the last megabyte alone.

    World: z up, in metres. Frame of the car: x ahead, y left, z up, on the ground; of a camera: x right,
    y down, z ahead. Write times in their order; at each time first the pose, then all else.

    Args:
        file: To write; its name ends in ``.mcap``.
        start_us: Time 0 in microseconds since 1970.
        replace: Take the place of an older file.

    Raises:
        InputError: The package is missing, the file is there already or, when the block ends, it could not
            be written.
    """

    def __init__(self, file: Path | str, *, start_us: int = START_US, replace: bool = False) -> None:
        need_foxglove()
        self._file, self._start_us = Path(file), start_us
        check_mcap(self._file, replace)
        self._new = new_file(self._file)
        self._mcap: McapFile | None = None
        self._cameras: dict[str, RigCamera] = {}

    def __enter__(self) -> "DriveRecording":
        partial = self._new.__enter__()
        try:
            self._mcap = McapFile(partial)
        except BaseException as error:
            self._new.__exit__(type(error), error, error.__traceback__)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        mcap, self._mcap = self._mcap, None
        assert mcap is not None
        full: OSError | None = None
        try:
            mcap.close()
        except OSError as failure:
            full = failure
        if full is not None and error in (None, full):
            self._new.__exit__(type(full), full, None)
        elif error is None:
            self._new.__exit__(None, None, None)
        else:
            # An OSError of the block itself would be taken for one of the file.
            self._new.__exit__(RuntimeError, RuntimeError("given up"), None)

    def describe(self, **facts: str) -> None:
        """Words about the drive: its name, where it was, where its pictures are from."""
        self._open.write_facts("drive", facts)

    def camera(self, name: str, pinhole: Camera, ego_from_camera: Float[np.ndarray, "4 4"]) -> None:
        """A camera of the car, before its first picture, and again where its mounting has changed.

        Args:
            name: It names the frame and the topics, such as ``CAM_FRONT``.
            pinhole: At the size of its pictures; its pose is not used.
            ego_from_camera: Its mounting.
        """
        if not name or "/" in name or name in (MAP, CAR):
            raise InputError(f"camera {name!r}: expected a name without slashes, other than {MAP} and {CAR}")
        check_rigid(ego_from_camera, f"mounting of {name}")
        self._cameras[name] = RigCamera(name, pinhole, ego_from_camera)

    def pose(self, time_s: float, world_from_ego: Float[np.ndarray, "4 4"]) -> None:
        """Where the car is, and its cameras on it."""
        check_rigid(world_from_ego, "the pose of the car")
        time_ns = self._ns(time_s)
        self._open.write(
            TRANSFORMS, transforms_of(time_ns, world_from_ego, [*self._cameras.values()]), time_ns
        )

    def picture(
        self, time_s: float, camera: str, picture: UInt8[np.ndarray, "h w 3"], *, lossless: bool = False
    ) -> None:
        """A picture of a camera, red, green, blue, as JPEG, or as PNG where nothing may be lost."""
        pinhole = self._camera(camera).pinhole
        expected = (pinhole.height_px, pinhole.width_px, 3)
        if picture.shape != expected or picture.dtype != np.uint8:
            raise InputError(
                f"picture of {camera}: {picture.dtype} {picture.shape}; expected uint8 {expected}"
            )
        suffix, settings = (".png", []) if lossless else (".jpg", [cv2.IMWRITE_JPEG_QUALITY, _JPEG])
        data = cv2.imencode(suffix, picture[..., ::-1], settings)[1].tobytes()
        self.encoded_picture(time_s, camera, data, "png" if lossless else "jpeg")

    def encoded_picture(self, time_s: float, camera: str, data: bytes, kind: str) -> None:
        """A picture of a camera as a file has it, of a kind that viewers know: jpeg, png or webp."""
        pinhole, time_ns = self._camera(camera).pinhole, self._ns(time_s)
        self._open.write(calibration_topic(camera), calibration_of(time_ns, camera, pinhole), time_ns)
        self._open.write(image_topic(camera), image_of(time_ns, camera, data, kind), time_ns)

    def boxes(self, time_s: float, boxes: Sequence[RecordedBox]) -> None:
        """All road users of a time; those of earlier times that are not among them are gone."""
        time_ns = self._ns(time_s)
        self._open.write(BOXES, boxes_of(time_ns, boxes), time_ns)

    def points(
        self, time_s: float, points_m: Float[np.ndarray, "n 3"], world_from_points: Float[np.ndarray, "4 4"]
    ) -> None:
        """What a lidar measured, in a frame of its own, and where that frame was."""
        check_rigid(world_from_points, "the pose of the points")
        time_ns = self._ns(time_s)
        self._open.write(LIDAR, cloud_of(time_ns, points_m, world_from_points), time_ns)

    def path(self, time_s: float, points_m: Float[np.ndarray, "n 3"]) -> None:
        """Where the car is to go, in the world, in place of what was planned before."""
        time_ns = self._ns(time_s)
        self._open.write(PATH, line_of(time_ns, points_m), time_ns)

    def number(self, time_s: float, name: str, value: float) -> None:
        """A number over time, such as the reward, to be plotted."""
        if not math.isfinite(value):
            raise InputError(f"{name} is {value} at {time_s:g} s; expected a finite number")
        self._open.write_json(number_topic(name), {"value": float(value)}, _NUMBER, self._ns(time_s))

    @property
    def _open(self) -> McapFile:
        if self._mcap is None:
            raise InputError(f"{self._file} is not being written; expected a recording inside its with block")
        return self._mcap

    def _camera(self, name: str) -> RigCamera:
        if name not in self._cameras:
            known = ", ".join(self._cameras) or "none"
            raise InputError(f"camera {name} is not known; tell it first (known are: {known})")
        return self._cameras[name]

    def _ns(self, time_s: float) -> int:
        """A time of the drive in nanoseconds since 1970."""
        if not 0 <= self._start_us / US + time_s < _LAST_S:  # NaN is not, either
            raise InputError(f"time {time_s} s after {self._start_us} microseconds; expected 1970 to 2106")
        return self._start_us * (NS // US) + round(time_s * NS)
