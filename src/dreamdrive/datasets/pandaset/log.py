"""A sequence of PandaSet as a log, and whatever of it is missing.

Poses of cameras have the axes of our cameras, and points and cuboids lie in the world. The pose of the lidar
has x to the right, y ahead and z up; all cameras of sequence 002 say so. Its origin is no lidar: it lies
``_ORIGIN_M`` above the road (0.32 to 0.36 m by the points labelled as road), and the front camera 1.81 m
above it and 0.85 m ahead of it.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from jaxtyping import Float
from msgspec import Meta
from scipy.spatial.transform import Rotation

from dreamdrive.data.cameras.fitted import check_middle, fitted
from dreamdrive.data.formats.pandaset import Place
from dreamdrive.data.pictures.images import read_image
from dreamdrive.datasets.pandaset.boxes import read_boxes
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, parse_json, read_json
from dreamdrive.files.paths import TEXT_BYTES, read_bytes
from dreamdrive.scene.camera import FARTHEST_M, Camera
from dreamdrive.scene.street.log import LidarSweep, Log, LogCamera
from dreamdrive.scene.trajectory import Trajectory

CAMERAS = (
    "front_camera",
    "front_left_camera",
    "front_right_camera",
    "left_camera",
    "back_camera",
    "right_camera",
)
_ORIGIN_M = 0.33
_FRONT_AHEAD_M, _FRONT_HEIGHT_M = 0.85, 2.14
"""Where the front camera is: before the origin, and above the road."""
_LEAST_LEVEL = 0.1
"""Sine of the angle between straight up and ahead; no road is so steep."""
_SIZE = 1920, 1080
"""Width and height of PandaSet's own pictures, which its calibration does not tell."""
_POSES, _TIMES, _INTRINSICS = "poses.json", "timestamps.json", "intrinsics.json"
_NOTE_EGO = (
    f"PandaSet has no pose of the car: it is taken {_ORIGIN_M} m below the pose of the lidar, on the road, "
    "and level from left to right: that pose is rolled against the road, by 1.8 degrees in sequence 002."
)
_NOTE_CAMERA = (
    f"There is no pose of the lidar: the car is taken {_FRONT_HEIGHT_M} m below and {_FRONT_AHEAD_M} m "
    "behind the front camera, as in sequence 002 of PandaSet."
)
_NOTE_MOUNTING = (
    "PandaSet has no mountings of its cameras: they are the mean of where the cameras were beside the car; "
    "the poses of the pictures are those of the files."
)


class _Xyz(msgspec.Struct):
    x: Place
    y: Place
    z: Place


class _Heading(msgspec.Struct):
    w: float
    x: float
    y: float
    z: float


class _Pose(msgspec.Struct):
    position: _Xyz
    heading: _Heading


class _Files(msgspec.Struct):
    poses: list[_Pose]
    times: list[Annotated[float, Meta(ge=0, le=1e11)]]


class _Intrinsics(msgspec.Struct):
    fx: float
    fy: float
    cx: float
    cy: float


def is_pandaset(path: Path) -> bool:
    """Whether a path is a folder of PandaSet or one of its sequences."""
    return bool(_sequences(path))


def scenes_of_pandaset(path: Path) -> tuple[str, ...]:
    """Names of all sequences."""
    return tuple(each.name for each in _sequences(path))


def read_pandaset(path: Path, scene: str) -> Log:
    """One sequence by its name.

    What is missing or broken is in ``problems``, and the rest works.

    Raises:
        InputError: There is no such sequence, or no camera of it can be read.
    """
    found = next((each for each in _sequences(path) if each.name == scene), None)
    if found is None:
        raise InputError(f"{path}: there is no sequence {scene}")
    problems: list[str] = []
    tracks = {name: track for name in CAMERAS if (track := _try_track(found / "camera" / name, problems))}
    lidar = _try_track(found / "lidar", problems)
    ego, notes = _ego(tracks, lidar, found, problems)
    tables = _numbered(found / "annotations" / "cuboids", len(ego), problems, "boxes")
    steps = sorted(tables) or list(range(len(ego)))
    start_s = float(ego.times_s[steps[0]])
    cameras = [
        camera
        for name, track in tracks.items()
        if (camera := _camera(found / "camera" / name, track, ego, set(steps), start_s, problems))
    ]
    if not cameras:
        raise InputError(f"{found}: no camera of it can be read: {'; '.join(problems)}")
    times_s = {step: float(time) - start_s for step, time in enumerate(ego.times_s)}
    sweeps = _numbered(found / "lidar", len(ego), problems, "sweeps of the lidar")
    return Log(
        name=found.name,
        about="",
        location="",
        root=found.parent,
        cameras=tuple(cameras),
        times_s=np.array([times_s[step] for step in steps]),
        start_us=round(start_s * 1e6),
        world_from_ego=ego.world_from_camera[steps],
        boxes=read_boxes(tables, times_s, problems),
        sweeps=tuple(LidarSweep(file, times_s[step], np.eye(4)) for step, file in sweeps.items()),
        notes=(*notes, _NOTE_MOUNTING),
        problems=tuple(problems),
    )


def _sequences(path: Path) -> list[Path]:
    """Folders of sequences: the path itself, or those in it."""
    path = path.absolute()
    folders = [path] if _is_sequence(path) else sorted(path.iterdir()) if path.is_dir() else []
    return [each for each in folders if _is_sequence(each)]


def _is_sequence(folder: Path) -> bool:
    return any((folder / "camera" / name / _POSES).is_file() for name in CAMERAS)


def _try_track(folder: Path, problems: list[str]) -> Trajectory | None:
    """The poses of a sensor at its times; None where they cannot be read, which is said."""
    try:
        return _track(folder)
    except InputError as error:
        problems.append(f"{error}: {folder.name} is left out")
        return None


def _track(folder: Path) -> Trajectory:
    read = {"poses": _json(folder / _POSES), "times": _json(folder / _TIMES)}
    files = of_type(read, _Files, str(folder))
    rows, times_s = files.poses, files.times
    if len(rows) != len(times_s) or not rows:
        raise InputError(
            f"{folder} has {len(rows)} poses and {len(times_s)} times; expected one of each a frame"
        )
    turns = np.array([(h.w, h.x, h.y, h.z) for h in (row.heading for row in rows)])
    if not (np.abs(np.linalg.norm(np.clip(turns, -2, 2), axis=1) - 1) < 1e-3).all():
        raise InputError(f"{folder / _POSES}: a heading is no quaternion of length 1")
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, :3] = Rotation.from_quat(turns, scalar_first=True).as_matrix()
    poses[:, :3, 3] = [(p.x, p.y, p.z) for p in (row.position for row in rows)]
    if np.abs(poses[:, :3, 3]).max() > FARTHEST_M / 2:
        raise InputError(f"{folder / _POSES}: places are over {FARTHEST_M / 2e3:g} km off; expected metres")
    try:
        return Trajectory(poses, np.array(times_s))
    except ValueError as error:
        raise InputError(f"{folder}: {error}") from None


def _json(path: Path) -> object:
    return parse_json(read_bytes(path, at_most=TEXT_BYTES), str(path))


def _ego(
    cameras: Mapping[str, Trajectory], lidar: Trajectory | None, folder: Path, problems: Sequence[str]
) -> tuple[Trajectory, tuple[str, ...]]:
    """Where the car was at each frame, and what was taken for it."""
    if lidar is not None:
        ahead = lidar.world_from_camera[:, :3, 1]
        return _upright(lidar, ahead, 0.0, _ORIGIN_M), (_NOTE_EGO,)
    front = cameras.get(CAMERAS[0])
    if front is None:
        raise InputError(
            f"{folder}: where the car was is not known, neither of lidar nor of front_camera: "
            f"{'; '.join(problems)}"
        )
    return _upright(front, front.world_from_camera[:, :3, 2], _FRONT_AHEAD_M, _FRONT_HEIGHT_M), (
        _NOTE_CAMERA,
    )


def _upright(
    track: Trajectory, ahead: Float[np.ndarray, "n 3"], before_m: float, above_m: float
) -> Trajectory:
    """The car below a sensor: ahead as told, with its pitch, and level from left to right."""
    left = np.cross((0.0, 0.0, 1.0), ahead)
    length = np.linalg.norm(left, axis=1, keepdims=True)
    if (length < _LEAST_LEVEL).any():
        raise InputError("the poses look up or down where the car looks ahead; download them again")
    left /= length
    poses = np.tile(np.eye(4), (len(track), 1, 1))
    poses[:, :3, :3] = np.stack([ahead, left, np.cross(ahead, left)], axis=2)
    poses[:, :3, 3] = track.positions_m
    ego_from_sensor = np.array([before_m, 0.0, above_m])
    poses[:, :3, 3] -= poses[:, :3, :3] @ ego_from_sensor
    return Trajectory(poses, track.times_s)


def _numbered(folder: Path, count: int, problems: list[str], what: str) -> dict[int, Path]:
    """Tables of frames that are there, by the number of the frame."""
    found = {
        step: file
        for step in range(count)
        for file in (folder / f"{step:02d}.pkl.gz", folder / f"{step:02d}.pkl")
        if file.is_file()
    }
    if not found:
        problems.append(f"{folder} has no files such as 00.pkl.gz: there are no {what}")
    elif len(found) < count:
        first = next(step for step in range(count) if step not in found)
        problems.append(
            f"{folder}: {count - len(found)} of {count} files are missing, the first: {first:02d}.pkl.gz"
        )
    return found


def _camera(
    folder: Path, track: Trajectory, ego: Trajectory, labelled: set[int], start_s: float, problems: list[str]
) -> LogCamera | None:
    """A camera with the pictures that are on disk; None where it cannot be used, which is said."""
    files = [folder / f"{step:02d}.jpg" for step in range(len(track))]
    there = [step for step, file in enumerate(files) if file.is_file()]
    if len(there) < len(files):
        first = next(file.name for file in files if not file.is_file())
        left = "; the camera is left out" if not there else ""
        problems.append(
            f"{folder.name}: {len(files) - len(there)} of {len(files)} pictures are missing, the first: "
            f"{first}{left}"
        )
    if not there:
        return None
    try:
        k = of_type(read_json(folder / _INTRINSICS), _Intrinsics, str(folder / _INTRINSICS))
        # Counted as OpenCV does, from the centre of the first pixel.
        size = read_image(files[there[0]]).size
        told = min((size, _SIZE), key=lambda each: abs(k.cx / each[0] - 0.5))
        pinhole = Camera(k.fx, k.fy, k.cx + 0.5, k.cy + 0.5, *told)
        check_middle(pinhole)
        pinhole = fitted(pinhole, size, problems, folder.name)
    except ValueError as error:
        problems.append(f"{folder.name}: no usable calibration ({error}); the camera is left out")
        return None
    return LogCamera(
        name=folder.name,
        files=tuple(files[step] for step in there),
        times_s=track.times_s[there] - start_s,
        world_from_camera=track.world_from_camera[there],
        ego_from_camera=_mounting(track, ego),
        pinhole=pinhole,
        key=np.array([step in labelled for step in there]),
    )


def _mounting(track: Trajectory, ego: Trajectory) -> Float[np.ndarray, "4 4"]:
    """Where a camera is beside the car, over the times at which both are known."""
    known = (track.times_s >= ego.times_s[0]) & (track.times_s <= ego.times_s[-1])
    rows = known if known.any() else np.ones(len(track), bool)
    beside = np.linalg.inv(ego.at(track.times_s[rows])) @ track.world_from_camera[rows]
    mounting = np.eye(4)
    mounting[:3, :3] = Rotation.from_matrix(beside[:, :3, :3]).mean().as_matrix()
    mounting[:3, 3] = np.median(beside[:, :3, 3], axis=0)
    return mounting
