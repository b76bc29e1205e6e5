"""Formats of pose files: Trajectory JSON, TUM, KITTI and PandaSet's cameras.json."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json
from dreamdrive.files.paths import read_text
from dreamdrive.scene.camera import FARTHEST_M
from dreamdrive.scene.trajectory import LATEST_S

FORMATS = (
    "Trajectory JSON (world_from_camera, times_s), TUM (timestamp tx ty tz qx qy qz qw), "
    "KITTI (12 numbers a line) or PandaSet's cameras.json"
)
_RIGID_TOLERANCE = 1e-3
"""How far R R^T may be from the identity, and a quaternion's length from 1: files print few digits."""


@dataclass(frozen=True)
class PoseRows:
    """The poses of a file, as they stand there.

    Attributes:
        world_from_camera: Rigid poses (N, 4, 4) in the file's own world.
        times_s: Times (N,), strictly increasing, or ``None`` where the format has none.
    """

    world_from_camera: Float[np.ndarray, "n 4 4"]
    times_s: Float[np.ndarray, " n"] | None

    def __len__(self) -> int:
        return len(self.world_from_camera)


def read_pose_file(path: Path, option: str, camera: str | None = None) -> PoseRows:
    """Read a pose file of any of the formats; the content decides which it is.

    Args:
        path: The file.
        option: How messages call it, such as ``--poses``.
        camera: Name of the camera to look for in PandaSet's ``cameras.json``.

    Raises:
        InputError: The file is missing or malformed, or a pose holds NaN or is not rigid.
    """
    where = f"{option} {path}"
    text = read_text(path, where)
    if not text.lstrip().startswith(("{", "[")):
        return _table(text, where)
    values = read_json(path, option)
    if "world_from_camera" in values:
        return _trajectory(values, where)
    if "cameras" in values:
        return _pandaset(values, where, camera)
    raise InputError(f"{where}: expected {FORMATS}")


def write_pose_file(path: Path, rows: PoseRows) -> None:
    """Write JSON, or TUM unless the name ends in ``.json``; an older file is replaced in one step.

    Raises:
        ValueError: The rows have no times.
        OSError: The folder cannot be written.
    """
    if rows.times_s is None:
        raise ValueError("poses without times cannot be written as a trajectory")
    if path.suffix.lower() == ".json":
        poses: list[Any] = rows.world_from_camera.astype(float).tolist()
        text = json.dumps({"world_from_camera": poses, "times_s": rows.times_s.astype(float).tolist()}) + "\n"
    else:
        quaternions = Rotation.from_matrix(rows.world_from_camera[:, :3, :3]).as_quat()
        table = np.column_stack([rows.times_s, rows.world_from_camera[:, :3, 3], quaternions])
        lines = [" ".join(repr(float(number)) for number in row) for row in table]
        text = "\n".join(["# timestamp tx ty tz qx qy qz qw", *lines]) + "\n"
    draft = path.with_name(path.name + ".part")
    draft.write_text(text, encoding="utf-8")
    draft.replace(path)


def _table(text: str, where: str) -> PoseRows:
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

    if table.shape[1] == 12:
        poses = np.tile(np.eye(4), (len(table), 1, 1))
        poses[:, :3] = table.reshape(-1, 3, 4)
        return PoseRows(clean_poses(poses, where, name), None)
    return PoseRows(_from_quaternions(table[:, 1:], where, name), _times(table[:, 0], where, name))


def _from_quaternions(
    table: Float[np.ndarray, "n 7"], where: str, name: Callable[[int], str]
) -> Float[np.ndarray, "n 4 4"]:
    length = np.linalg.norm(np.clip(table[:, 3:], -10, 10), axis=1)
    for index in np.flatnonzero(~(np.abs(length - 1) <= _RIGID_TOLERANCE)).tolist():
        raise InputError(f"{where}: {name(index)}: the quaternion has length {length[index]:.4g}; expected 1")
    poses = np.tile(np.eye(4), (len(table), 1, 1))
    poses[:, :3, :3] = Rotation.from_quat(table[:, 3:]).as_matrix()
    poses[:, :3, 3] = table[:, :3]
    return clean_poses(poses, where, name)


def _trajectory(values: dict[str, Any], where: str) -> PoseRows:
    poses = clean_poses(_array(values["world_from_camera"], where), where, _pose_name)
    times = _array(values.get("times_s", []), where)
    if times.shape != (len(poses),):
        raise InputError(
            f"{where}: {len(poses)} poses, but times_s has the shape {times.shape}; expected one a pose"
        )
    return PoseRows(poses, _times(times, where, _pose_name))


def _pandaset(values: dict[str, Any], where: str, camera: str | None) -> PoseRows:
    cameras = cast("dict[str, Any]", values["cameras"] if isinstance(values["cameras"], dict) else {})
    if camera not in cameras:
        raise InputError(
            f"{where} has the cameras {', '.join(cameras)}; none is called like the input, {camera!r}: "
            "name the input folder like its camera"
        )
    entry = cast("dict[str, Any]", cameras[camera] if isinstance(cameras[camera], dict) else {})
    poses = clean_poses(_array(entry.get("camera_to_world", []), where), where, _pose_name)
    frames = _array(entry.get("frames", list(range(len(poses)))), where)
    if frames.ndim != 1 or not len(frames) or not np.isin(frames, np.arange(len(poses))).all():
        raise InputError(f"{where}: frames of {camera}: expected a list of indices of its {len(poses)} poses")
    return PoseRows(poses[frames.astype(int)], None)


def _array(values: object, where: str) -> Float[np.ndarray, "..."]:
    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{where}: expected arrays of numbers; each pose has 4 rows of 4") from None


def _pose_name(index: int) -> str:
    return f"pose {index} (counted from 0)"


def _times(times: Float[np.ndarray, " n"], where: str, name: Callable[[int], str]) -> Float[np.ndarray, " n"]:
    later = np.concatenate([[True], times[1:] > times[:-1]])
    for index in np.flatnonzero(~((np.abs(times) <= LATEST_S) & later)).tolist():
        raise InputError(
            f"{where}: {name(index)}: time {times[index]:g}; expected finite, increasing times in seconds"
        )
    return times


def clean_poses(
    poses: Float[np.ndarray, "..."], where: str, name: Callable[[int], str]
) -> Float[np.ndarray, "n 4 4"]:
    """Check each pose and take the rounding of the file out of its rotation.

    Args:
        poses: As they stand in the file.
        where: How messages call the file.
        name: How messages call a pose, by its row.

    Raises:
        InputError: They are no 4x4 matrices, or one holds NaN or is not rigid.
    """
    if poses.ndim != 3 or poses.shape[1:] != (4, 4) or not len(poses):
        raise InputError(f"{where}: the poses have the shape {poses.shape}; expected (N, 4, 4), N at least 1")
    for index in np.flatnonzero(~np.isfinite(poses).all(axis=(1, 2))).tolist():
        raise InputError(f"{where}: {name(index)} holds NaN or infinite numbers")
    most = np.abs(poses).max(axis=(1, 2))
    for index in np.flatnonzero(most > FARTHEST_M).tolist():
        raise InputError(
            f"{where}: {name(index)} holds {most[index]:.4g}; expected places within {FARTHEST_M:g} m of the "
            "origin: take the same offset from all of them"
        )
    rotation = poses[:, :3, :3]
    error = np.abs(rotation @ rotation.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    last = np.abs(poses[:, 3] - (0, 0, 0, 1)).max(axis=1)
    bad = (error > _RIGID_TOLERANCE) | (last > _RIGID_TOLERANCE) | (np.linalg.det(rotation) < 0)
    for index in np.flatnonzero(bad).tolist():
        raise InputError(
            f"{where}: {name(index)} is not rigid (R R^T differs from the identity by {error[index]:.2g}); "
            "expected a right-handed rotation without scale, and 0 0 0 1 as the last row"
        )
    left, _, right = np.linalg.svd(rotation)
    clean = np.tile(np.eye(4), (len(poses), 1, 1))
    clean[:, :3, :3] = left @ right
    clean[:, :3, 3] = poses[:, :3, 3]
    return clean
