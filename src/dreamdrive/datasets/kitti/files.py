"""Files that drives and sequences of KITTI have in common: numbers by names, pictures by number."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dreamdrive.data.formats.rigid import clean_poses
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_text
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.log import LogCamera

FARTHEST_MOUNT_M = 100.0
"""Farther apart no two sensors of a car are."""

Pose = Float[np.ndarray, "4 4"]


@dataclass(frozen=True)
class KittiCamera:
    """A camera of KITTI.

    Attributes:
        name: As its folder is called.
        files: Its pictures by their number.
        camera: At the size of the pictures.
        camera_0_from_camera: Its place beside the rectified camera 0.
    """

    name: str
    files: Mapping[int, Path]
    camera: Camera
    camera_0_from_camera: Pose


def numbers_by_name(path: Path) -> dict[str, Float[np.ndarray, " n"]]:
    """Lines such as ``R: 1 0 0 ...`` of a calibration; those with other than finite numbers are left out."""
    found: dict[str, Float[np.ndarray, " n"]] = {}
    for line in read_text(path).splitlines():
        name, _, rest = line.partition(":")
        try:
            values = np.array([float(word) for word in rest.split()])
        except ValueError:
            continue
        if np.isfinite(values).all():
            found[name.strip()] = values
    return found


def entry(rows: Mapping[str, Float[np.ndarray, " n"]], name: str, count: int, path: Path) -> np.ndarray:
    """The numbers of a name, which have to be ``count``."""
    values = rows.get(name, np.zeros(0))
    if values.shape != (count,):
        raise InputError(
            f"{path}: expected a line {name}: with {count} numbers, got {len(values)}; download it again"
        )
    return values


def rigid(rotation: np.ndarray, place: np.ndarray, where: str) -> Pose:
    """The transform of 9 numbers of a rotation and 3 of a place, without the rounding of the file."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation.reshape(3, 3), place
    return check_mounting(clean_poses(pose[None], where, lambda row: "the transform")[0], where)


def check_mounting(pose: Pose, where: str) -> Pose:
    """The transform between two sensors of a car, which has to be short."""
    if (apart_m := float(np.linalg.norm(pose[:3, 3]))) > FARTHEST_MOUNT_M:
        raise InputError(
            f"{where} puts two sensors {apart_m:.4g} m apart; expected those of a car: download it again"
        )
    return pose


def numbered_files(folder: Path, suffix: str) -> dict[int, Path]:
    """Files whose names are numbers, by these numbers in their order."""
    if not folder.is_dir():
        return {}
    named = {file.name.removesuffix(suffix): file for file in folder.iterdir() if file.name.endswith(suffix)}
    found = {int(stem): file for stem, file in named.items() if stem.isascii() and stem.isdecimal()}
    return dict(sorted(found.items()))


def missing(name: str, found: Mapping[int, Path], wanted: Sequence[int], problems: list[str]) -> list[int]:
    """Those of the wanted numbers that have a file; the others are told of."""
    there = [step for step in wanted if step in found]
    if 0 < len(there) < len(wanted):
        first = next(step for step in wanted if step not in found)
        problems.append(
            f"{name}: {len(wanted) - len(there)} of {len(wanted)} files are missing, first {first}"
        )
    return there


def log_camera(
    mounted: KittiCamera,
    times_s: Mapping[int, float],
    world_from_ego: Mapping[int, Pose],
    ego_from_camera_0: Pose,
    problems: list[str],
) -> LogCamera | None:
    """The pictures of a camera of which time and pose are known; None where there are none, which is said."""
    known = [step for step in world_from_ego if isfinite(times_s.get(step, np.nan))]
    steps = missing(mounted.name, mounted.files, known, problems)
    if not steps:
        problems.append(f"{mounted.name}: no picture has a time and a pose; the camera is left out")
        return None
    ego_from_camera = ego_from_camera_0 @ mounted.camera_0_from_camera
    clock = np.array([times_s[step] for step in steps])
    if (np.diff(clock) <= 0).any():
        problems.append(f"{mounted.name}: its times do not increase; the camera is left out")
        return None
    return LogCamera(
        name=mounted.name,
        files=tuple(mounted.files[step] for step in steps),
        times_s=clock,
        world_from_camera=np.stack([world_from_ego[step] @ ego_from_camera for step in steps]),
        ego_from_camera=ego_from_camera,
        pinhole=mounted.camera,
        key=np.ones(len(steps), bool),
    )
