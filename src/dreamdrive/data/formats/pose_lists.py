"""Lists of poses: Trajectory JSON, TUM, and KITTI with its calibration.

All are world_from_camera with x right, y down, z forward, in metres. Trajectory JSON: ``world_from_camera``,
a list of 4x4 matrices, and ``times_s``. TUM: timestamp, position and quaternion xyzw a line. KITTI: 12
numbers a line, the upper rows of a matrix; ``calib.txt`` holds rectified projections P0 to P3 (3x4), whose
pixels count from 0 at the centre of the first.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.data.cameras.fitted import check_middle
from dreamdrive.data.formats.rigid import RIGID_TOLERANCE, PoseRows, clean_poses, numbers, pose_name
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_text
from dreamdrive.scene.camera import Camera, check_rigid
from dreamdrive.scene.trajectory import LATEST_S, Trajectory

FORMATS = (
    "Trajectory JSON (world_from_camera, times_s), TUM (timestamp tx ty tz qx qy qz qw), "
    "KITTI (12 numbers a line) or PandaSet's cameras.json"
)


def poses_of_text(text: str, where: str) -> PoseRows:
    """The poses of KITTI or TUM."""
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split("#")[0].replace(",", " ").split()
        if not words:
            continue
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            raise InputError(f"{where}: line {number} is not made of numbers; expected {FORMATS}") from None
        lines.append(number)
        if len(rows[-1]) != len(rows[0]):
            raise InputError(f"{where}: line {number} has {len(rows[-1])} numbers, the first {len(rows[0])}")
    if not rows or len(rows[0]) not in (8, 12):
        got = f"{len(rows[0])} numbers a line" if rows else "no poses"
        raise InputError(f"{where} holds {got}; expected {FORMATS}")
    table = np.array(rows)

    def name(index: int) -> str:
        return f"line {lines[index]}"

    poses = np.tile(np.eye(4), (len(table), 1, 1))
    if table.shape[1] == 12:
        poses[:, :3] = table.reshape(-1, 3, 4)
        return PoseRows(where, clean_poses(poses, where, name))
    length = np.linalg.norm(np.clip(table[:, 4:], -10, 10), axis=1)
    for index in np.flatnonzero(~(np.abs(length - 1) <= RIGID_TOLERANCE)).tolist():
        raise InputError(f"{where}: {name(index)}: the quaternion has length {length[index]:.4g}; expected 1")
    poses[:, :3, :3] = Rotation.from_quat(table[:, 4:]).as_matrix()
    poses[:, :3, 3] = table[:, 1:4]
    return PoseRows(where, clean_poses(poses, where, name), _times(table[:, 0], where, name))


def poses_of_json(values: Mapping[str, Any], where: str) -> PoseRows:
    """The poses of Trajectory JSON."""
    if "world_from_camera" not in values:
        raise InputError(f"{where}: world_from_camera is missing; expected a 4x4 matrix for each pose")
    poses = clean_poses(numbers(values["world_from_camera"], where), where, pose_name)
    times = numbers(values.get("times_s", []), where)
    if times.shape != (len(poses),):
        raise InputError(
            f"{where}: {len(poses)} poses, but times_s has the shape {times.shape}; expected one a pose"
        )
    return PoseRows(where, poses, _times(times, where, pose_name))


def _times(times: Float[np.ndarray, " n"], where: str, name: Callable[[int], str]) -> Float[np.ndarray, " n"]:
    later = np.concatenate([[True], times[1:] > times[:-1]])
    for index in np.flatnonzero(~((np.abs(times) <= LATEST_S) & later)).tolist():
        raise InputError(
            f"{where}: {name(index)}: time {times[index]:g}; expected finite, increasing times in seconds"
        )
    return times


def text_of(trajectory: Trajectory) -> str:
    """A trajectory in TUM's format."""
    poses = trajectory.world_from_camera
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    table = np.column_stack([trajectory.times_s, poses[:, :3, 3], quaternions])
    lines = [" ".join(repr(float(number)) for number in row) for row in table]
    return "\n".join(["# timestamp tx ty tz qx qy qz qw", *lines]) + "\n"


def json_of(trajectory: Trajectory) -> str:
    """A trajectory as Trajectory JSON."""
    poses: list[Any] = trajectory.world_from_camera.astype(float).tolist()
    values = {"world_from_camera": poses, "times_s": trajectory.times_s.astype(float).tolist()}
    return json.dumps(values) + "\n"


def kitti_camera(path: Path, name: str, picture: tuple[int, int]) -> tuple[Camera, Float[np.ndarray, "4 4"]]:
    """The pinhole of a camera P0 to P3 in ``calib.txt``, for its pictures' size, and camera_0_from_camera."""
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
    try:
        return parts_of_projection(matrix.reshape(3, 4), picture)
    except ValueError as error:
        raise InputError(f"{path}: {name} is no projection of a camera: {error}") from error


def parts_of_projection(
    matrix: Float[np.ndarray, "3 4"], picture: tuple[int, int]
) -> tuple[Camera, Float[np.ndarray, "4 4"]]:
    """The pinhole of a rectified projection of KITTI, and camera_0_from_camera.

    Raises:
        ValueError: It is none of a camera.
    """
    beside = np.eye(4)
    try:
        camera = Camera(matrix[0, 0], matrix[1, 1], matrix[0, 2] + 0.5, matrix[1, 2] + 0.5, *picture)
        check_middle(camera)
        with np.errstate(over="ignore", invalid="ignore"):  # what is too large is refused below
            beside[:3, 3] = -np.linalg.solve(matrix[:, :3], matrix[:, 3])
    except np.linalg.LinAlgError as error:
        raise ValueError(str(error)) from error
    check_rigid(beside, "its place beside camera 0")
    return camera, beside
