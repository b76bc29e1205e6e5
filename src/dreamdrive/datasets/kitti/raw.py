"""A raw drive of KITTI as a log: rectified pictures, poses by GPS and IMU, lidar and boxes.

Poses are those of the devkit: latitude and longitude by a Mercator projection at the scale of the first
latitude, x east, y north, z up. The IMU has x ahead, y left, z up; the ego frame is ``IMU_HEIGHT_M`` below it
on the road (Geiger et al. 2013, figure 3), 0.32 m to the left of the lidar. Drives come rectified and in step
(``_sync``): files of one number are of one time.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from dreamdrive.data.cameras.fitted import fitted
from dreamdrive.data.formats.pose_lists import parts_of_projection
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
from dreamdrive.datasets.kitti.tracklets import TRACKLETS, read_tracklets
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_text
from dreamdrive.scene.street.log import BoxTrack, LidarSweep, Log, LogCamera

IMU_HEIGHT_M = 0.93
"""Of the IMU above the road."""
_FARTHEST_M = 1e6
EARTH_M = 6_378_137.0
_IMU_FROM_EGO = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -IMU_HEIGHT_M], [0, 0, 0, 1]])
_COLOUR, _GREY = ("image_02", "image_03"), ("image_00", "image_01")
_CAMERAS, _LIDAR, _IMU = "calib_cam_to_cam.txt", "calib_velo_to_cam.txt", "calib_imu_to_velo.txt"
_STAMP = re.compile(r"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d)(\.\d{1,12})?", re.ASCII)
_DRIVE = "*_drive_*_sync"
_NOTES = (
    f"KITTI has no pose of the car: it is taken {IMU_HEIGHT_M} m below the IMU, on the road.",
    "KITTI's times are those of Karlsruhe without a zone; they are taken as UTC.",
)


def is_kitti_raw(path: Path) -> bool:
    """Whether a path is a raw drive, a date's folder with drives, or the folder of all dates."""
    return bool(_drives(path))


def scenes_of_kitti_raw(path: Path) -> tuple[str, ...]:
    """Names of all drives, such as ``2011_09_26_drive_0001_sync``."""
    return tuple(each.name for each in _drives(path))


def read_kitti_raw(path: Path, scene: str) -> Log:
    """One drive by its name.

    What is missing or broken is in ``problems``, and the rest works.

    Raises:
        InputError: There is no such drive, it lacks calibration or poses, or no camera of it can be read.
    """
    drive = next((each for each in _drives(path) if each.name == scene), None)
    if drive is None:
        raise InputError(f"{path}: there is no drive {scene}")
    rig = _rig(drive.parent)
    problems: list[str] = []
    world_from_ego, clock_us = _car(drive / "oxts", problems)
    start_us = next(iter(clock_us.values()))
    times_s = {step: (time - start_us) / 1e6 for step, time in clock_us.items()}
    cameras: list[LogCamera] = []
    for mounted in _mounted(drive, problems):
        own = _clock(drive / mounted.name, start_us, times_s, problems)
        camera = log_camera(mounted, own, world_from_ego, rig.ego_from_camera_0, problems)
        if camera is not None:
            cameras.append(camera)
    if not cameras:
        raise InputError(f"{drive}: no camera of it can be read: {'; '.join(problems)}")
    world_from_lidar = {step: pose @ rig.ego_from_lidar for step, pose in world_from_ego.items()}
    return Log(
        name=drive.name,
        about="",
        location="",
        root=drive.parent.parent,
        cameras=tuple(cameras),
        times_s=np.array(list(times_s.values())),
        start_us=round(start_us),
        world_from_ego=np.stack(list(world_from_ego.values())),
        boxes=_boxes(drive / TRACKLETS, times_s, world_from_lidar, problems),
        sweeps=_sweeps(drive, start_us, times_s, world_from_lidar, problems),
        notes=_NOTES,
        problems=tuple(problems),
    )


def _drives(path: Path) -> list[Path]:
    """Folders of drives: the path itself, or those one or two levels below it."""
    path = path.absolute()
    found = [path] if path.match(_DRIVE) else [*path.glob(_DRIVE), *path.glob(f"*/{_DRIVE}")]
    return sorted(each for each in found if any((each / name / "data").is_dir() for name in _COLOUR + _GREY))


@dataclass(frozen=True)
class _Rig:
    """Where the sensors are; camera 0 is the rectified one."""

    ego_from_camera_0: Pose
    ego_from_lidar: Pose


def _rig(folder: Path) -> _Rig:
    lidar_from_imu, camera_from_lidar = (
        rigid(entry(rows, "R", 9, file), entry(rows, "T", 3, file), str(file))
        for file, rows in ((folder / name, _numbers(folder / name)) for name in (_IMU, _LIDAR))
    )
    file = folder / _CAMERAS
    rectified = rigid(entry(_numbers(file), "R_rect_00", 9, file), np.zeros(3), f"{file}: R_rect_00")
    ego_from_lidar = np.linalg.inv(lidar_from_imu @ _IMU_FROM_EGO)
    return _Rig(ego_from_lidar @ np.linalg.inv(rectified @ camera_from_lidar), ego_from_lidar)


def _numbers(path: Path) -> dict[str, np.ndarray]:
    if not path.is_file():
        raise InputError(
            f"{path} is missing, without which it is not known where the sensors are; download the "
            "calibration of that date and put it beside the drives"
        )
    return numbers_by_name(path)


def _car(folder: Path, problems: list[str]) -> tuple[dict[int, Pose], dict[int, float]]:
    """Where the car was, and when in microseconds since 1970, by the number of the frame."""
    rows: dict[int, list[float]] = {}
    for step, file in numbered_files(folder / "data", ".txt").items():
        try:
            rows[step] = _row(file)
        except InputError as error:
            problems.append(f"{error}; that frame is left out")
    clock = _stamps(folder / "timestamps.txt")
    rows = {step: row for step, row in rows.items() if step in clock}
    if not rows:
        raise InputError(
            f"{folder}: no frame has both a file in data and a time, without which it is not known where the "
            "car was; expected oxts as KITTI has it"
        )
    times = [clock[step] for step in rows]
    if (np.diff(times) <= 0).any():
        raise InputError(f"{folder / 'timestamps.txt'}: its times do not increase; download it again")
    poses = poses_of_gps(rows)
    if max(float(np.abs(pose).max()) for pose in poses.values()) > _FARTHEST_M:
        raise InputError(f"{folder}: the car moves over {_FARTHEST_M / 1e3:g} km; download it again")
    return poses, dict(zip(rows, times, strict=True))


def poses_of_gps(rows: Mapping[int, list[float]]) -> dict[int, Pose]:
    """Poses world_from_ego of latitude and longitude in degrees, height in metres, roll, pitch and yaw.

    Yaw counts from east, against the clock. The world is east, north and up from the first place of
    the car.
    """
    table = np.array(list(rows.values()))
    latitude, longitude = np.deg2rad(table[:, 0]), np.deg2rad(table[:, 1])
    scale = np.cos(latitude[0])
    east = scale * EARTH_M * longitude
    north = scale * EARTH_M * np.log(np.tan(np.pi / 4 + latitude / 2))
    places = np.stack([east, north, table[:, 2]], axis=1)
    poses = np.tile(np.eye(4), (len(table), 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("xyz", table[:, 3:6]).as_matrix()
    poses[:, :3, 3] = places - places[0]
    poses = poses @ _IMU_FROM_EGO
    poses[:, :3, 3] -= poses[0, :3, 3]
    return dict(zip(rows, poses, strict=True))


def _row(path: Path) -> list[float]:
    """Latitude, longitude, height, roll, pitch and yaw, the first six of 30 numbers."""
    try:
        values = [float(word) for word in read_text(path).split()[:6]]
    except ValueError as error:
        raise InputError(f"{path} cannot be read ({error})") from None
    limits = (85.0, 360.0, 1e5, 10.0, 10.0, 10.0)
    if len(values) < 6 or not all(abs(v) <= most for v, most in zip(values, limits, strict=True)):
        raise InputError(f"{path} does not begin with latitude, longitude, height, roll, pitch and yaw")
    return values


def _stamps(path: Path) -> dict[int, float]:
    """Times in microseconds since 1970 by line, such as ``2011-09-26 13:02:25.964389445``."""
    found: dict[int, float] = {}
    for step, line in enumerate(read_text(path).splitlines()):
        parts = _STAMP.fullmatch(line.strip())
        try:
            whole = None if parts is None else datetime.fromisoformat(parts[1]).replace(tzinfo=UTC)
        except ValueError:
            continue
        if parts is not None and whole is not None:
            found[step] = whole.timestamp() * 1e6 + float(parts[2] or 0) * 1e6
    return found


def _clock(
    folder: Path, start_us: float, times_s: Mapping[int, float], problems: list[str]
) -> Mapping[int, float]:
    """Times of a sensor's own; those of GPS and IMU where it has none, which is said."""
    try:
        return {step: (time - start_us) / 1e6 for step, time in _stamps(folder / "timestamps.txt").items()}
    except InputError as error:
        problems.append(f"{folder.name} has no times of its own ({error}); those of oxts count")
        return times_s


def _mounted(drive: Path, problems: list[str]) -> list[KittiCamera]:
    """Colour cameras, or the grey ones where there are none, the left one first."""
    file = drive.parent / _CAMERAS
    rows = _numbers(file)
    colour = [name for name in _COLOUR if (drive / name / "data").is_dir()]
    found: list[KittiCamera] = []
    for name in colour or [name for name in _GREY if (drive / name / "data").is_dir()]:
        files = numbered_files(drive / name / "data", ".png") or numbered_files(drive / name / "data", ".jpg")
        if not files:
            problems.append(f"{name}: no pictures such as 0000000000.png; the camera is left out")
            continue
        try:
            width, height = (int(side) for side in entry(rows, f"S_rect_{name[-2:]}", 2, file))
            p = entry(rows, f"P_rect_{name[-2:]}", 12, file).reshape(3, 4)
            camera, beside = parts_of_projection(p, (width, height))
            camera = fitted(camera, read_image(next(iter(files.values()))).size, problems, name)
            check_mounting(beside, f"{file}: P_rect_{name[-2:]}")
        except ValueError as error:
            problems.append(f"{name}: no usable calibration ({error}); the camera is left out")
            continue
        found.append(KittiCamera(name, files, camera, beside))
    return found


def _sweeps(
    drive: Path,
    start_us: float,
    times_s: Mapping[int, float],
    world_from_lidar: Mapping[int, Pose],
    problems: list[str],
) -> tuple[LidarSweep, ...]:
    folder = drive / "velodyne_points"
    files = numbered_files(folder / "data", ".bin")
    if not files:
        return ()
    clock = _clock(folder, start_us, times_s, problems)
    return tuple(
        LidarSweep(files[step], clock.get(step, times_s[step]), world_from_lidar[step])
        for step in missing(folder.name, files, list(world_from_lidar), problems)
    )


def _boxes(
    path: Path, times_s: Mapping[int, float], world_from_lidar: Mapping[int, Pose], problems: list[str]
) -> tuple[BoxTrack, ...]:
    """Boxes, which not all drives have."""
    if not path.is_file():
        return ()
    try:
        return read_tracklets(path, times_s, world_from_lidar, problems)
    except InputError as error:
        problems.append(f"{error}: there are no boxes")
        return ()
