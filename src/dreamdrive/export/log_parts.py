"""Parts of a log as other formats want them: whole-number times, the car's path, pictures as bytes."""

from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.data.pictures.picture_file import PICTURE_BYTES, parse_header
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.log import Log

US, NS = 1_000_000, 1_000_000_000
"""Microseconds and nanoseconds in a second."""


def stamps(log: Log, times_s: Float[np.ndarray, " n"], per_s: int = US) -> Int[np.ndarray, " n"]:
    """Times since 1970, in microseconds or nanoseconds."""
    return log.start_us * (per_s // US) + np.rint(times_s * per_s).astype(np.int64)


def path_of(log: Log, per_s: int = US) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 4 4"]]:
    """Where the car was at each picture and each labelled time: times since 1970, poses in the log's world.

    Where several cameras have a picture of one time, the first of them tells.
    """
    places: dict[int, np.ndarray] = {}
    for camera in log.cameras:
        poses = camera.world_from_camera @ np.linalg.inv(camera.ego_from_camera)
        for time, pose in zip(stamps(log, camera.times_s, per_s).tolist(), poses, strict=True):
            places.setdefault(time, pose)
    for time, pose in zip(stamps(log, log.times_s, per_s).tolist(), log.world_from_ego, strict=True):
        places.setdefault(time, pose)
    times = sorted(places)
    return np.array(times), np.stack([places[each] for each in times])


def picture_of(file: Path, pinhole: Camera) -> tuple[bytes, str]:
    """The bytes of a picture and their format; ``InputError`` where it is not of the pinhole's size."""
    data = read_bytes(file, at_most=PICTURE_BYTES)
    header, wanted = parse_header(data), (pinhole.width_px, pinhole.height_px, 1)
    if header is None or (header.width_px, header.height_px, header.orientation) != wanted:
        raise InputError(f"{file}: expected an upright picture of {wanted[0]}x{wanted[1]} pixels")
    return data, header.kind.lower()
