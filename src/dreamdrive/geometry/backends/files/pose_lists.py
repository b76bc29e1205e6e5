"""KITTI, TUM and Trajectory JSON: poses alone, KITTI's with the calibration beside them.

KITTI: 12 numbers a line, the upper rows of world_from_camera. TUM: timestamp, position and quaternion xyzw of
world_from_camera. Both have x right, y down, z forward, and metres. ``calib.txt`` of KITTI holds rectified
projections P0 to P3 (3x4), for the source's pictures; their pixels count from 0 at the centre of the first,
so 0.5 is added to the principal point. KITTI's poses are those of camera 0: those of another camera, which
``geometry.json`` or an input folder such as ``image_2`` names, lie beside them by the last column of its P.
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.data.camera_models import LensCamera
from dreamdrive.data.poses import read_poses
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_text
from dreamdrive.geometry.backends.files.declared import read_declared
from dreamdrive.geometry.backends.files.depth import find_depth
from dreamdrive.geometry.backends.files.given import Given
from dreamdrive.geometry.backends.files.json_record import OPTION
from dreamdrive.geometry.backends.files.wanted import Wanted
from dreamdrive.scene.camera import Camera, check_rigid

CALIBRATION = "calib.txt"


def read_pose_list(path: Path, wanted: Wanted) -> Given:
    """Read a list of poses, and KITTI's calibration beside it.

    Raises:
        InputError: A file is malformed or the poses fit the frames in no way.
    """
    declared = read_declared(path.parent)
    poses, notes = read_poses(path, wanted.folder, wanted.index, wanted.times_s, wanted.count, OPTION)
    cameras: tuple[LensCamera, ...] = ()
    calibration = path.parent / CALIBRATION
    if calibration.is_file():
        name = _camera_name(declared.camera or wanted.folder)
        camera, beside = _calibrated(calibration, name, wanted.picture)
        cameras = (LensCamera(camera, None),)
        poses = poses @ beside
        said = f"The poses of {path.name} count as those of KITTI's camera 0, the clip as camera {name[1]}."
        notes += (said,)
    return Given(
        poses,
        metric=declared.metric is not False,
        cameras=cameras,
        camera=np.zeros(len(wanted.index), np.intp),
        depth=replace(
            find_depth(path.parent / "depth", wanted.labels, declared), kitti=calibration.is_file()
        ),
        notes=notes,
    )


def _camera_name(said: str) -> str:
    """P0 to P3, from a name such as P2 or image_2; P0 where the name is no camera of KITTI."""
    number = re.fullmatch(r"(?:P|image_0?)([0-3])", said)
    return f"P{number[1] if number else 0}"


def _calibrated(path: Path, name: str, picture: tuple[int, int]) -> tuple[Camera, Float[np.ndarray, "4 4"]]:
    """The pinhole of a camera, and camera_0_from_camera."""
    try:
        lines = [line.partition(":") for line in read_text(path).splitlines()]
        rows = {key.strip(): [float(word) for word in rest.split()] for key, _, rest in lines if key.strip()}
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{path}: cannot be read as KITTI's calibration ({error})") from error
    matrix = np.array(rows.get(name, []))
    if matrix.shape != (12,) or not np.isfinite(matrix).all():
        got = ", ".join(rows) or "nothing"
        raise InputError(f"{path}: expected a line {name}: with 12 numbers, got {got}")
    matrix = matrix.reshape(3, 4)
    try:
        camera = Camera(matrix[0, 0], matrix[1, 1], matrix[0, 2] + 0.5, matrix[1, 2] + 0.5, *picture)
    except ValueError as error:
        raise InputError(f"{path}: {name}: {error}") from error
    beside = np.eye(4)
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # what is too large is refused below
            beside[:3, 3] = -np.linalg.solve(matrix[:, :3], matrix[:, 3])
        check_rigid(beside, "its place beside camera 0")
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InputError(f"{path}: {name} is no projection of a camera: {error}") from error
    return camera, beside
