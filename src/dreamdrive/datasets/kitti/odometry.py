"""A sequence of KITTI's odometry benchmark as a log: rectified pictures, poses of camera 0, and lidar.

The ego frame is level with camera 0, on the ground ``HEIGHT_M`` below it, which is where the cameras are
mounted (Geiger et al. 2013, figure 3). It has the pitch and roll of the camera, which looks ahead. The world
is the ego frame at the first pose.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dreamdrive.data.formats.pose_lists import kitti_camera, poses_of_text
from dreamdrive.data.pictures.images import read_image
from dreamdrive.datasets.kitti.files import (
    KittiCamera,
    Pose,
    check_mounting,
    entry,
    log_camera,
    missing,
    numbered_files,
    numbers_by_name,
    rigid,
)
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_text
from dreamdrive.scene.street.log import LidarSweep, Log

HEIGHT_M = 1.65
"""Of the cameras above the road."""
EGO_FROM_CAMERA_0 = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, HEIGHT_M], [0, 0, 0, 1]])
_COLOUR, _GREY = ("image_2", "image_3"), ("image_0", "image_1")
_CALIBRATION, _TIMES = "calib.txt", "times.txt"
_LATEST_S = 1e6
_FARTHEST_M = 1e6
_NOTES = (
    f"KITTI odometry has no pose of the car: it is taken {HEIGHT_M} m below camera 0, on the road, with the "
    "pitch and roll of that camera.",
    "The times of KITTI odometry count from the first picture; the date is not told.",
)


def is_kitti_odometry(path: Path) -> bool:
    """Whether a path is the folder of the benchmark or one of its sequences."""
    return bool(_sequences(path))


def scenes_of_kitti_odometry(path: Path) -> tuple[str, ...]:
    """Names of all sequences, such as ``04``; 11 to 21 have no poses."""
    return tuple(each.name for each in _sequences(path))


def read_kitti_odometry(path: Path, scene: str) -> Log:
    """One sequence by its name.

    What is missing or broken is in ``problems``, and the rest works.

    Raises:
        InputError: There is no such sequence, it has no poses or times, or no camera of it can be read.
    """
    found = next((each for each in _sequences(path) if each.name == scene), None)
    if found is None:
        raise InputError(f"{path}: there is no sequence {scene}")
    poses = _poses(found)
    times_s = _times(found / _TIMES, len(poses))
    egos = EGO_FROM_CAMERA_0 @ poses @ np.linalg.inv(EGO_FROM_CAMERA_0)
    world_from_ego = dict(enumerate(egos))
    problems: list[str] = []
    cameras = [
        camera
        for mounted in _mounted(found, problems)
        if (
            camera := log_camera(
                mounted, dict(enumerate(times_s)), world_from_ego, EGO_FROM_CAMERA_0, problems
            )
        )
    ]
    if not cameras:
        raise InputError(f"{found}: no camera of it can be read: {'; '.join(problems)}")
    return Log(
        name=found.name,
        about="",
        location="",
        root=found.parent.parent,
        cameras=tuple(cameras),
        times_s=np.array(times_s),
        start_us=0,
        world_from_ego=egos,
        sweeps=_sweeps(found, times_s, EGO_FROM_CAMERA_0 @ poses, problems),
        notes=_NOTES,
        problems=tuple(problems),
    )


def _sequences(path: Path) -> list[Path]:
    """Folders of sequences: the path itself, or those below it, as they are or in ``dataset``."""
    path = path.absolute()
    if path.parent.name == "sequences" and _is_sequence(path):
        return [path]
    folders = [path / "sequences", path / "dataset" / "sequences"]
    folder = next((each for each in folders if each.is_dir()), None)
    return [each for each in sorted(folder.iterdir()) if _is_sequence(each)] if folder else []


def _is_sequence(folder: Path) -> bool:
    pictures = any((folder / name).is_dir() for name in (*_COLOUR, *_GREY))
    return pictures and any((folder / name).is_file() for name in (_CALIBRATION, _TIMES))


def _poses(sequence: Path) -> np.ndarray:
    """Poses world_from_camera of camera 0."""
    file = sequence.parent.parent / "poses" / f"{sequence.name}.txt"
    if not file.is_file():
        raise InputError(
            f"{file} is missing, without which it is not known where the car was; download the poses of "
            "KITTI odometry (sequences 11 to 21 have none)"
        )
    rows = poses_of_text(read_text(file), str(file))
    if rows.times_s is not None:
        raise InputError(f"{file} has 8 numbers a line; expected 12, the upper rows of a matrix")
    if not (np.abs(rows.world_from_camera[:, :3, 3]) <= _FARTHEST_M).all():
        raise InputError(
            f"{file} has places over {_FARTHEST_M / 1e3:g} km off; expected metres from the first"
        )
    return rows.world_from_camera


def _times(path: Path, count: int) -> list[float]:
    try:
        times = [float(word) for word in read_text(path).split()]
    except ValueError as error:
        raise InputError(f"{path} cannot be read: {error}; expected a time in seconds a line") from None
    if len(times) < count:
        raise InputError(f"{path} has {len(times)} times, but there are {count} poses; download it again")
    times = times[:count]
    if not (np.abs(times) <= _LATEST_S).all() or (np.diff(times) <= 0).any():
        raise InputError(f"{path}: expected times in seconds that increase; download it again")
    return [time - times[0] for time in times]


def _mounted(sequence: Path, problems: list[str]) -> list[KittiCamera]:
    """Colour cameras, or the grey ones where there are none, the left one first."""
    colour = [name for name in _COLOUR if (sequence / name).is_dir()]
    found: list[KittiCamera] = []
    for name in colour or [name for name in _GREY if (sequence / name).is_dir()]:
        files = numbered_files(sequence / name, ".png")
        if not files:
            problems.append(f"{name}: no pictures such as 000000.png; the camera is left out")
            continue
        try:
            size = read_image(next(iter(files.values()))).size
            camera, beside = kitti_camera(sequence / _CALIBRATION, f"P{name[-1]}", size)
            check_mounting(beside, f"{sequence / _CALIBRATION}: P{name[-1]}")
        except InputError as error:
            problems.append(f"{name}: no usable calibration ({error}); the camera is left out")
            continue
        found.append(KittiCamera(name, files, camera, beside))
    return found


def _sweeps(
    sequence: Path, times_s: Sequence[float], world_from_camera_0: np.ndarray, problems: list[str]
) -> tuple[LidarSweep, ...]:
    files = numbered_files(sequence / "velodyne", ".bin")
    if not files:
        return ()
    try:
        camera_0_from_lidar = _lidar(sequence / _CALIBRATION)
    except InputError as error:
        problems.append(f"{error}: there are no sweeps of the lidar")
        return ()
    return tuple(
        LidarSweep(files[step], times_s[step], world_from_camera_0[step] @ camera_0_from_lidar)
        for step in missing("velodyne", files, range(len(times_s)), problems)
    )


def _lidar(path: Path) -> Pose:
    values = entry(numbers_by_name(path), "Tr", 12, path).reshape(3, 4)
    return rigid(values[:, :3], values[:, 3], f"{path}: Tr")
