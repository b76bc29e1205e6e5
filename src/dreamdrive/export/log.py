"""Logs of what a car's cameras see of a scene, with files: pictures, lidar, labels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.export.lidar import EGO_FROM_LIDAR, turned
from dreamdrive.export.nuscenes.writer import write_points
from dreamdrive.files.output import plain_name
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.log import BoxTrack, LidarSweep, Log, LogCamera, LogMap, box_corners
from dreamdrive.scene.visibility import View, level_of, share_seen

KEY_S = 0.5
"""Time between labelled frames, as in nuScenes."""
AXLE_M = 1.7
"""The ego frame lies under the rear axle, as in nuScenes, so far behind the front camera."""
START_US = 1_500_000_000_000_000
"""A clock has to begin somewhere."""
_NEAR_M = 80.0
_JPEG = 95
MOVING_M_S = 0.5
"""What is faster moves."""
_WORDS = {
    "vehicle": ("vehicle.moving", "vehicle.stopped"),
    "human": ("pedestrian.moving", "pedestrian.standing"),
}
_PARKED = "vehicle.parked"

Look = Callable[[int, int], tuple[UInt8[np.ndarray, "h w 3"], Float[np.ndarray, "h w"]]]
"""The picture of a camera at a step and depth along z in metres, 0 where there is none."""

Retouch = Callable[[UInt8[np.ndarray, "h w 3"]], UInt8[np.ndarray, "h w 3"]]
"""What changes a picture before it is written."""


@dataclass(frozen=True)
class RigCamera:
    """A camera of the car: its name, its pinhole, and its mounting."""

    name: str
    pinhole: Camera
    ego_from_camera: Float[np.ndarray, "4 4"]


@dataclass(frozen=True)
class Moved:
    """A thing with a box at every step, in the words of ``BoxTrack``; ``there`` tells when it is.

    Without ``attributes`` they are those of its motion.
    """

    id: str
    category: str
    size_lwh_m: Float[np.ndarray, "3"]
    world_from_box: Float[np.ndarray, "t 4 4"]
    there: Bool[np.ndarray, " t"]
    attributes: tuple[tuple[str, ...], ...] | None = None


@dataclass(frozen=True)
class Taken:
    """A drive to be written: where the car is at each time, what it carries, and what is around it."""

    name: str
    about: str
    location: str
    times_s: Float[np.ndarray, " t"]
    world_from_ego: Float[np.ndarray, "t 4 4"]
    cameras: tuple[RigCamera, ...]
    look: Look
    boxes: tuple[Moved, ...]
    map: LogMap
    lidar: bool = True


def take(drive: Taken, folder: Path, progress: Progress = silent, *, blur: Retouch | None = None) -> Log:
    """Write pictures and lidar of a drive into a folder, and tell what they are of.

    Every ``KEY_S`` seconds a time is labelled: it has lidar points and boxes within 80 m of the car. How much
    of a box is seen is told by depth: something nearer hides it.
    """
    keys = _key_steps(drive.times_s)
    files: dict[str, list[Path]] = {camera.name: [] for camera in drive.cameras}
    sweeps: list[LidarSweep] = []
    labels: dict[int, dict[str, tuple[int, int]]] = {}
    for step in range(len(drive.times_s)):
        views: list[View] = []
        for index, camera in enumerate(drive.cameras):
            picture, depth_m = drive.look(index, step)
            shown = picture if blur is None else blur(picture)
            files[camera.name].append(_write_picture(folder, camera.name, step, shown))
            pose = drive.world_from_ego[step] @ camera.ego_from_camera
            views.append((camera.pinhole.at(pose), depth_m))
        if step in keys:
            pose = drive.world_from_ego[step] @ EGO_FROM_LIDAR
            points = turned(views, pose)
            if drive.lidar:
                place = folder / "points" / f"{step:06d}.pcd.bin"
                place.parent.mkdir(parents=True, exist_ok=True)
                write_points(place, points)
                sweeps.append(LidarSweep(place, float(drive.times_s[step]), pose))
            world = points @ pose[:3, :3].T + pose[:3, 3]
            labels[step] = {box.id: _label(box, step, views, world) for box in drive.boxes}
        progress(step + 1, len(drive.times_s))
    key = np.isin(np.arange(len(drive.times_s)), keys)
    cameras = tuple(_camera(drive, camera, tuple(files[camera.name]), key) for camera in drive.cameras)
    boxes = [_track(drive, box, keys, labels) for box in drive.boxes]
    return Log(
        name=drive.name,
        about=drive.about,
        location=drive.location,
        root=folder,
        cameras=cameras,
        times_s=drive.times_s[keys],
        start_us=START_US,
        world_from_ego=drive.world_from_ego[keys],
        boxes=tuple(box for box in boxes if box is not None),
        sweeps=tuple(sweeps),
        map=drive.map,
    )


def _key_steps(times_s: Float[np.ndarray, " t"]) -> list[int]:
    """Steps nearest to multiples of ``KEY_S``."""
    wanted = np.arange(0.0, times_s[-1] - times_s[0] + 1e-6, KEY_S)
    return sorted(set(np.abs(times_s[None] - times_s[0] - wanted[:, None]).argmin(axis=1).tolist()))


def _write_picture(folder: Path, camera: str, step: int, picture: UInt8[np.ndarray, "h w 3"]) -> Path:
    place = folder / "pictures" / plain_name(camera) / f"{step:06d}.jpg"
    place.parent.mkdir(parents=True, exist_ok=True)
    write_picture(place, picture[..., ::-1], quality=_JPEG)
    return place


def _camera(
    drive: Taken, camera: RigCamera, files: tuple[Path, ...], key: Bool[np.ndarray, " t"]
) -> LogCamera:
    poses = drive.world_from_ego @ camera.ego_from_camera
    return LogCamera(
        camera.name, files, drive.times_s, poses, camera.ego_from_camera, camera.pinhole.at(np.eye(4)), key
    )


def _label(box: Moved, step: int, views: Sequence[View], points: Float[np.ndarray, "n 3"]) -> tuple[int, int]:
    """The level of visibility of a box, and how many points lie in it."""
    pose, half = box.world_from_box[step], box.size_lwh_m / 2
    corners = box_corners(pose, box.size_lwh_m)
    inside = (np.abs((points - pose[:3, 3]) @ pose[:3, :3]) <= half).all(axis=1)
    return level_of(share_seen(corners, views)), int(inside.sum())


def _track(
    drive: Taken, box: Moved, keys: Sequence[int], labels: dict[int, dict[str, tuple[int, int]]]
) -> BoxTrack | None:
    away_m = np.linalg.norm(box.world_from_box[:, :2, 3] - drive.world_from_ego[:, :2, 3], axis=1)
    steps = [step for step in keys if box.there[step] and away_m[step] < _NEAR_M]
    if not steps:
        return None
    speed = _speed_m_s(drive.times_s, box)
    ever = bool(speed.max() > MOVING_M_S)
    moves = [int(speed[step] > MOVING_M_S) for step in steps]
    return BoxTrack(
        id=box.id,
        category=box.category,
        times_s=drive.times_s[steps],
        world_from_box=box.world_from_box[steps],
        size_lwh_m=np.repeat(box.size_lwh_m[None], len(steps), axis=0),
        visibility=np.array([labels[step][box.id][0] for step in steps]),
        moves=np.array(moves),
        lidar_points=np.array([labels[step][box.id][1] for step in steps]),
        attributes=tuple(_words(box.category, bool(each), ever) for each in moves)
        if box.attributes is None
        else tuple(box.attributes[step] for step in steps),
    )


def _speed_m_s(times_s: Float[np.ndarray, " t"], box: Moved) -> Float[np.ndarray, " t"]:
    if len(times_s) < 2:
        return np.zeros(len(times_s))
    return np.linalg.norm(np.gradient(box.world_from_box[:, :3, 3], times_s, axis=0), axis=1)


def _words(category: str, moves: bool, ever: bool) -> tuple[str, ...]:
    if category.startswith(("vehicle.bicycle", "vehicle.motorcycle")):
        return ("cycle.with_rider" if ever else "cycle.without_rider",)
    moving, resting = _WORDS.get(category.split(".")[0], ("", ""))
    if not moving:
        return ()
    if not ever and category.startswith("vehicle"):
        return (_PARKED,)
    return (moving if moves else resting,)
