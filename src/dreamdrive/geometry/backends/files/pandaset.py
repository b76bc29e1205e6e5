"""PandaSet as one ``cameras.json`` of all cameras.

``{"cameras": {name: {"width", "height", "K": 3x3, "camera_to_world": [4x4, ...], "frames": [index, ...]}}}``:
axes x right, y down, z forward, metres, ``frames`` the poses that have a picture. ``K`` is a calibration in
OpenCV's way, the first pixel's centre at 0: 0.5 is added to its principal point.
"""

from pathlib import Path
from typing import Any, cast

import numpy as np

from dreamdrive.data.camera_models import LensCamera, MatrixPinhole
from dreamdrive.data.poses import read_poses
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type
from dreamdrive.geometry.backends.files.declared import NAME, read_declared
from dreamdrive.geometry.backends.files.depth import find_depth
from dreamdrive.geometry.backends.files.given import Given
from dreamdrive.geometry.backends.files.json_record import OPTION, read_record
from dreamdrive.geometry.backends.files.wanted import Wanted
from dreamdrive.scene.camera import Camera


def read_pandaset(path: Path, wanted: Wanted) -> Given:
    """Read one camera: that of ``geometry.json``, or the only one, or the one that is called like the input.

    Raises:
        InputError: The file is malformed, the camera cannot be told, or its poses do not fit the frames.
    """
    record = read_record(path)
    declared = read_declared(path.parent)
    cameras = cast("dict[str, Any]", record["cameras"])
    name = declared.camera or (next(iter(cameras)) if len(cameras) == 1 else wanted.folder)
    if name not in cameras:
        raise InputError(
            f"{path} has the cameras {', '.join(cameras)}, none called {name!r}: name the input folder "
            f'like its camera, or write {{"camera": NAME}} into {NAME} beside it'
        )
    camera = _camera(cameras[name], f"{path}: {name}")
    poses, notes = read_poses(path, name, wanted.index, wanted.times_s, wanted.count, OPTION)
    return Given(
        poses,
        metric=declared.metric is not False,
        cameras=(LensCamera(camera, None),),
        camera=np.zeros(len(wanted.index), np.intp),
        depth=find_depth(path.parent / "depth", wanted.labels, declared),
        notes=notes,
    )


def _camera(entry: Any, where: str) -> Camera:
    try:
        return of_type(entry, MatrixPinhole, where).camera()
    except ValueError as error:
        raise InputError(f"{where}: expected width, height and K, a 3x3 matrix ({error})") from error
