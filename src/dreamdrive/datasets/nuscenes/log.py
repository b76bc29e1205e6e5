"""A scene of nuScenes as a log, and whatever of it is missing."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.data.cameras.fitted import fitted
from dreamdrive.data.pictures.images import read_image
from dreamdrive.datasets.nuscenes.maps import map_of
from dreamdrive.datasets.nuscenes.tables import (
    AnnotationRow,
    CalibratedRow,
    DataRow,
    InstanceRow,
    LogRow,
    NamedRow,
    PoseRow,
    SampleRow,
    SceneRow,
    SensorRow,
    Tables,
    VisibilityRow,
    find_tables,
    open_tables,
)
from dreamdrive.errors import InputError
from dreamdrive.files.paths import is_path
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.log import BoxTrack, LidarSweep, Log, LogCamera

LIDAR = "LIDAR_TOP"
_ORDER = ("CAM_FRONT", "CAM_FRONT_LEFT", "CAM_FRONT_RIGHT", "CAM_BACK_LEFT", "CAM_BACK", "CAM_BACK_RIGHT")
_REACH_M = 250.0
"""How far around a drive its map is read: more than a bird's-eye view of it reaches."""
_LEVELS = {"v0-40": 1, "v40-60": 2, "v60-80": 3, "v80-100": 4}
_AT_REST = (".parked", ".stopped", ".standing", ".sitting_lying_down", ".without_rider")


def is_nuscenes(path: Path) -> bool:
    """Whether a path is a folder of nuScenes or of one of its versions."""
    return bool(find_tables(path))


def scenes_of_nuscenes(path: Path) -> tuple[str, ...]:
    """Names of all scenes, in the order of the table."""
    return tuple(row.name for row in open_tables(path).rows("scene", SceneRow).values())


def read_nuscenes(path: Path, scene: str) -> Log:
    """One scene by its name.

    What is missing or broken is in ``problems``, and the rest works.

    Raises:
        InputError: There is no such scene, no table of what is needed, or no camera of it has pictures.
    """
    tables = open_tables(path)
    changed = tuple(sorted((each.name, _changed_ns(each)) for each in tables.folder.glob("*.json")))
    return _read(tables.folder, scene, changed)


def _changed_ns(path: Path) -> int:
    """When a file was changed; 0 of a link that leads nowhere."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


@lru_cache(maxsize=2)
def _read(folder: Path, scene: str, changed: tuple[tuple[str, int], ...]) -> Log:
    """Kept for those who ask again while the files are the same: full tables take many seconds."""
    del changed
    tables = open_tables(folder)
    chosen = _scene(tables, scene)
    samples = tables.rows("sample", SampleRow, "scene_token", {chosen.token})
    if not samples:
        raise InputError(f"{tables.folder}: sample.json has no row of the scene {chosen.name}")
    times = sorted(samples.values(), key=lambda row: row.timestamp)
    start_us = times[0].timestamp
    shots = _shots(tables, samples)
    cameras = _cameras(tables, shots, start_us)
    if not cameras:
        said = "; ".join(tables.problems) or "no row of sample_data.json is of a camera"
        raise InputError(f"{tables.folder}: no camera of {chosen.name} has pictures: {said}")
    logs = tables.optional("log", LogRow, "places of scenes")
    log = logs.get(chosen.log_token)
    location = "" if log is None else log.location
    times_s = np.array([(row.timestamp - start_us) / 1e6 for row in times])
    world_from_ego, notes = _ego(shots, times, cameras[0], times_s)
    return Log(
        name=chosen.name,
        about=chosen.description,
        location=location,
        root=tables.root,
        cameras=cameras,
        times_s=times_s,
        start_us=start_us,
        world_from_ego=world_from_ego,
        boxes=_boxes(tables, samples, start_us),
        sweeps=_sweeps(tables, shots, start_us),
        map=map_of(tables, chosen.log_token, location, _around(cameras)),
        notes=notes,
        problems=tables.problems,
    )


def _around(cameras: Sequence[LogCamera]) -> Float[np.ndarray, "2 2"]:
    """Least and largest x and y of what lies around the drive."""
    places = np.concatenate([camera.world_from_camera[:, :2, 3] for camera in cameras])
    return np.stack([places.min(axis=0) - _REACH_M, places.max(axis=0) + _REACH_M])


@dataclass(frozen=True)
class _Shot:
    """A row of ``sample_data`` with all that it points to."""

    row: DataRow
    world_from_ego: Float[np.ndarray, "4 4"]
    calibrated: CalibratedRow
    sensor: SensorRow

    @property
    def ego_from_sensor(self) -> Float[np.ndarray, "4 4"]:
        return pose_of(self.calibrated)


def pose_of(row: PoseRow | CalibratedRow) -> Float[np.ndarray, "4 4"]:
    """The rigid transform of a translation and a quaternion wxyz."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(row.rotation, scalar_first=True).as_matrix()
    pose[:3, 3] = row.translation
    return pose


def _scene(tables: Tables, wanted: str) -> SceneRow:
    rows = tables.rows("scene", SceneRow)
    found = next((row for row in rows.values() if row.name == wanted), None)
    if found is None:
        raise InputError(f"{tables.folder}: there is no scene {wanted}")
    return found


def _shots(tables: Tables, samples: Mapping[str, SampleRow]) -> dict[str, list[_Shot]]:
    """What each channel took in a scene, in the order of time, without rows whose tokens lead nowhere."""
    rows = tables.rows("sample_data", DataRow, "sample_token", samples)
    sensors = tables.rows("sensor", SensorRow)
    mounted = tables.rows("calibrated_sensor", CalibratedRow)
    mounted = _whole_rotations(tables, "calibrated_sensor", mounted)
    linked = tables.linked(mounted.values(), "calibrated_sensor", "sensor", lambda r: r.sensor_token, sensors)
    calibrated = {row.token: row for row in linked}
    wanted = {row.ego_pose_token for row in rows.values()}
    poses = tables.rows("ego_pose", PoseRow, "token", wanted)
    poses = _whole_rotations(tables, "ego_pose", poses)
    kept = tables.linked(
        rows.values(), "sample_data", "calibrated_sensor", lambda r: r.calibrated_sensor_token, calibrated
    )
    kept = tables.linked(kept, "sample_data", "ego_pose", lambda r: r.ego_pose_token, poses)
    shots: dict[str, list[_Shot]] = defaultdict(list)
    for row in sorted(kept, key=lambda each: each.timestamp):
        mount = calibrated[row.calibrated_sensor_token]
        sensor = sensors[mount.sensor_token]
        shots[sensor.channel].append(_Shot(row, pose_of(poses[row.ego_pose_token]), mount, sensor))
    return shots


_Posed = TypeVar("_Posed", PoseRow, CalibratedRow, AnnotationRow)


def _whole_rotations(tables: Tables, name: str, rows: dict[str, _Posed]) -> dict[str, _Posed]:
    """Rows whose quaternions have the length 1."""
    kept = {token: row for token, row in rows.items() if abs(np.linalg.norm(row.rotation) - 1) < 1e-3}
    for token in rows.keys() - kept.keys():
        tables.fault(f"{name}.json: quaternions are not of length 1; their rows are left out", token)
    return kept


def _cameras(tables: Tables, shots: Mapping[str, Sequence[_Shot]], start_us: int) -> tuple[LogCamera, ...]:
    """Cameras that have pictures on disk, the front one first."""
    channels = [name for name, taken in shots.items() if taken[0].sensor.modality in ("camera", "")]
    channels = [name for name in channels if name.startswith("CAM")] or channels
    found: list[LogCamera] = []
    for name in sorted(channels, key=lambda each: (each not in _ORDER, _rank(each), each)):
        camera = _camera(tables, name, shots[name], start_us)
        if camera is not None:
            found.append(camera)
    return tuple(found)


def _rank(channel: str) -> int:
    return _ORDER.index(channel) if channel in _ORDER else 0


def _camera(tables: Tables, name: str, shots: Sequence[_Shot], start_us: int) -> LogCamera | None:
    files = _files(tables, name, shots)
    there = [(shot, file) for shot, file in zip(shots, files, strict=True) if file is not None]
    if not there:
        tables.fault(f"{name}: none of its {len(shots)} pictures is there; the camera is left out")
        return None
    first, told = there[0][0], list[str]()
    try:
        pinhole = fitted(_pinhole(first), read_image(there[0][1]).size, told, name)
        made = LogCamera(
            name=name,
            files=tuple(file for _, file in there),
            times_s=np.array([(shot.row.timestamp - start_us) / 1e6 for shot, _ in there]),
            world_from_camera=np.stack([shot.world_from_ego @ shot.ego_from_sensor for shot, _ in there]),
            ego_from_camera=first.ego_from_sensor,
            pinhole=pinhole,
            key=np.array([shot.row.is_key_frame for shot, _ in there]),
        )
    except ValueError as error:
        tables.fault(f"{name}: no usable calibration or poses ({error}); the camera is left out")
        return None
    for each in told:
        tables.fault(each)
    return made


def _pinhole(shot: _Shot) -> Camera:
    """The calibration, whose first pixel has its centre at 0."""
    k = np.array(shot.calibrated.camera_intrinsic, dtype=np.float64)
    if k.shape != (3, 3) or not np.isfinite(k).all():
        raise ValueError(f"camera_intrinsic of {shot.calibrated.token} is no 3x3 matrix")
    row = shot.row
    return Camera(k[0, 0], k[1, 1], k[0, 2] + 0.5, k[1, 2] + 0.5, row.width, row.height)


def _files(tables: Tables, name: str, shots: Sequence[_Shot]) -> list[Path | None]:
    """Where the pictures lie, below the root or, as a table may say, beside it; None where they do not."""
    files: list[Path | None] = []
    for shot in shots:
        given = shot.row.filename
        path = tables.root / given if is_path(given) else None
        there = path is not None and path.is_file()
        if not there:
            tables.fault(f"{name}: files of sample_data.json are missing", given[:200])
        files.append(path if there else None)
    return files


def _sweeps(tables: Tables, shots: Mapping[str, Sequence[_Shot]], start_us: int) -> tuple[LidarSweep, ...]:
    taken = shots.get(LIDAR, [])
    return tuple(
        LidarSweep(file, (shot.row.timestamp - start_us) / 1e6, shot.world_from_ego @ shot.ego_from_sensor)
        for shot, file in zip(taken, _files(tables, LIDAR, taken), strict=True)
        if file is not None
    )


def _ego(
    shots: Mapping[str, Sequence[_Shot]],
    samples: Sequence[SampleRow],
    camera: LogCamera,
    times_s: Float[np.ndarray, " t"],
) -> tuple[Float[np.ndarray, "t 4 4"], tuple[str, ...]]:
    """Where the car was at each sample: when the lidar took it, else when the first camera did."""
    by_lidar = {s.row.sample_token: s.world_from_ego for s in shots.get(LIDAR, []) if s.row.is_key_frame}
    if all(sample.token in by_lidar for sample in samples):
        return np.stack([by_lidar[sample.token] for sample in samples]), ()
    nearest = np.abs(camera.times_s[None] - times_s[:, None]).argmin(axis=1)
    ego = camera.world_from_camera[nearest] @ np.linalg.inv(camera.ego_from_camera)
    return ego, (
        f"There are no {LIDAR} records: the car is where it was when {camera.name} took its picture, up to "
        f"{np.abs(camera.times_s[nearest] - times_s).max():.2f} s from the labelled time.",
    )


def _boxes(tables: Tables, samples: Mapping[str, SampleRow], start_us: int) -> tuple[BoxTrack, ...]:
    """Boxes by what they are of, each in the order of time."""
    lost = "boxes"
    rows = tables.optional("sample_annotation", AnnotationRow, lost, "sample_token", samples)
    if not rows:
        return ()
    wanted = {row.instance_token for row in rows.values()}
    instances = tables.optional("instance", InstanceRow, lost, "token", wanted)
    categories = tables.optional("category", NamedRow, lost)
    named = tables.linked(instances.values(), "instance", "category", lambda r: r.category_token, categories)
    known = {row.token: categories[row.category_token].name for row in named}
    kept = tables.linked(rows.values(), "sample_annotation", "instance", lambda r: r.instance_token, known)
    levels = tables.optional("visibility", VisibilityRow, "shares of boxes that are visible")
    names = tables.optional("attribute", NamedRow, "attributes of boxes")
    whole = _whole_rotations(tables, "sample_annotation", {row.token: row for row in kept})
    tracks: dict[str, list[AnnotationRow]] = defaultdict(list)
    for row in sorted(whole.values(), key=lambda each: samples[each.sample_token].timestamp):
        tracks[row.instance_token].append(row)
    return tuple(
        _track(token, known[token], track, samples, levels, names, start_us)
        for token, track in tracks.items()
    )


def _track(
    token: str,
    category: str,
    rows: Sequence[AnnotationRow],
    samples: Mapping[str, SampleRow],
    levels: Mapping[str, VisibilityRow],
    names: Mapping[str, NamedRow],
    start_us: int,
) -> BoxTrack:
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, :3] = Rotation.from_quat([row.rotation for row in rows], scalar_first=True).as_matrix()
    poses[:, :3, 3] = [row.translation for row in rows]
    told = tuple(tuple(names[t].name for t in row.attribute_tokens if t in names) for row in rows)
    seen = [levels[row.visibility_token].level if row.visibility_token in levels else "" for row in rows]
    return BoxTrack(
        id=token,
        category=category,
        times_s=np.array([(samples[row.sample_token].timestamp - start_us) / 1e6 for row in rows]),
        world_from_box=poses,
        size_lwh_m=np.array([row.size for row in rows])[:, [1, 0, 2]],
        visibility=np.array([_LEVELS.get(level, 0) for level in seen]),
        moves=np.array([_moves(each) for each in told]),
        lidar_points=np.array([row.num_lidar_pts for row in rows]),
        attributes=told,
    )


def _moves(attributes: tuple[str, ...]) -> int:
    if any(name.endswith(".moving") for name in attributes):
        return 1
    return 0 if any(name.endswith(_AT_REST) for name in attributes) else -1
