"""Logs as a data set in the format of nuScenes: all tables, pictures, lidar, and maps."""

import json
import shutil
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.datasets.nuscenes.tables import token
from dreamdrive.export.nuscenes.maps import write_maps
from dreamdrive.files.kinds import NUSCENES_KIND
from dreamdrive.files.output import new_folder, plain_name
from dreamdrive.scene.street.log import BoxTrack, LidarSweep, Log, LogCamera
from dreamdrive.scene.trajectory import Trajectory

VERSION = "v1.0-mini"
"""The devkit takes the versions mini, trainval and test alone."""
TABLES = (
    "attribute",
    "calibrated_sensor",
    "category",
    "ego_pose",
    "instance",
    "log",
    "map",
    "sample",
    "sample_annotation",
    "sample_data",
    "scene",
    "sensor",
    "visibility",
)
_LEVELS = {1: "v0-40", 2: "v40-60", 3: "v60-80", 4: "v80-100", 5: "unknown"}
_UNKNOWN = 5
"""Token of a visibility that nobody told, which nuScenes has not: programs that drop what is seen too little
keep it."""

Rows = dict[str, list[dict[str, Any]]]
Points = Callable[[Path], Float[np.ndarray, "n 3"]]


def write_nuscenes(
    logs: Sequence[Log], folder: Path, points: Points, *, version: str = VERSION, replace: bool = False
) -> None:
    """Write drives as a data set; the folder appears whole or not at all.

    Pictures are copied as they are. Lidar points are written as ``.pcd.bin``, with an intensity of 0. What
    was read from nuScenes comes back the same; a track whose id an earlier drive has gets another. Boxes of
    no labelled time raise ``ValueError``.

    Args:
        logs: The drives; names that are the same raise ``ValueError``.
        folder: To write.
        points: Reads the points of a sweep's file.
        version: Name of the folder with the tables.
        replace: Take the place of an older folder of this kind.
    """
    if len({log.name for log in logs}) < len(logs):
        raise ValueError("nuScenes: two drives of one name")
    with new_folder(folder, replace=replace, kind=NUSCENES_KIND) as made:
        (made / version).mkdir(parents=True)
        rows: Rows = {name: [] for name in TABLES}
        rows["visibility"] = [
            {"token": str(k), "level": level, "description": ""} for k, level in _LEVELS.items()
        ]
        for log in logs:
            _Writer(log, made, rows, points).write()
        write_maps(logs, made, rows["map"])
        for name, table in rows.items():
            write_table(made / version / f"{name}.json", table)


def write_table(path: Path, rows: list[dict[str, Any]]) -> None:
    """A list of rows as JSON."""
    path.write_text(json.dumps(rows, indent=0, allow_nan=False) + "\n", "utf-8")


class _Writer:
    """One drive."""

    def __init__(self, log: Log, folder: Path, rows: Rows, points: Points) -> None:
        self.log, self.folder, self.rows, self.points = log, folder, rows, points
        self.samples = [token(log.name, "sample", k) for k in range(len(log.times_s))]
        self.scene = token(log.name, "scene")

    def write(self) -> None:
        """Its rows and files."""
        log = self.log
        stamp = datetime.fromtimestamp(log.start_us / 1e6, UTC)
        place = {"token": token(log.name, "log"), "logfile": log.name, "vehicle": "dreamdrive"}
        place |= {"date_captured": stamp.date().isoformat(), "location": log.location}
        self.rows["log"].append(place)
        self.rows["scene"].append(
            {
                "token": self.scene,
                "log_token": place["token"],
                "nbr_samples": len(self.samples),
                "first_sample_token": self.samples[0],
                "last_sample_token": self.samples[-1],
                "name": log.name,
                "description": log.about,
            }
        )
        samples = [
            {"token": own, "timestamp": self._stamp(t), "scene_token": self.scene}
            for own, t in zip(self.samples, log.times_s, strict=True)
        ]
        self.rows["sample"] += chained(samples)
        for camera in log.cameras:
            self._camera(camera)
        self._lidar()
        for track in log.boxes:
            self._track(track)

    def _stamp(self, time_s: float) -> int:
        return self.log.start_us + round(float(time_s) * 1e6)

    def _camera(self, camera: LogCamera) -> None:
        pinhole = camera.pinhole
        mounted = self._mounted(camera.name, "camera", camera.ego_from_camera, pinhole.index_matrix.tolist())
        ego = camera.world_from_camera @ np.linalg.inv(camera.ego_from_camera)
        shots = [
            self._shot(camera.name, mounted, t, pose, bool(key), file.suffix.lstrip("."))
            | {"width": pinhole.width_px, "height": pinhole.height_px}
            for t, pose, key, file in zip(camera.times_s, ego, camera.key, camera.files, strict=True)
        ]
        for shot, file in zip(shots, camera.files, strict=True):
            shutil.copyfile(file, self._place(str(shot["filename"])))
        self.rows["sample_data"] += chained(shots)

    def _lidar(self) -> None:
        """Sweeps in the frame of the lidar, as the car carries it; points in the world stay there."""
        shots: list[dict[str, Any]] = []
        path = Trajectory(self.log.world_from_ego, self.log.times_s)
        for sweep in self.log.sweeps:
            near = int(np.abs(self.log.times_s - sweep.time_s).argmin())
            key = bool(abs(self.log.times_s[near] - sweep.time_s) < 1e-3)
            ego = self.log.world_from_ego[near] if key else self._carried(sweep, path)
            mounted = self._mounted("LIDAR_TOP", "lidar", np.linalg.inv(ego) @ sweep.world_from_points, [])
            shot = self._shot("LIDAR_TOP", mounted, sweep.time_s, ego, key, "pcd.bin")
            write_points(self._place(shot["filename"]), self.points(sweep.file))
            shots.append(shot | {"width": 0, "height": 0, "fileformat": "pcd"})
        self.rows["sample_data"] += chained(shots)

    def _carried(self, sweep: LidarSweep, path: Trajectory) -> Float[np.ndarray, "4 4"]:
        """Where the car was between labelled times: as its lidar tells if that is fixed, else in between."""
        first = self.log.sweeps[0]
        start = int(np.abs(self.log.times_s - first.time_s).argmin())
        mount = np.linalg.inv(self.log.world_from_ego[start]) @ first.world_from_points
        between = path.at(np.array([sweep.time_s]))[0]
        told = sweep.world_from_points @ np.linalg.inv(mount)
        return told if np.linalg.norm(told[:3, 3] - between[:3, 3]) < 1.0 else between

    def _mounted(self, channel: str, modality: str, pose: Float[np.ndarray, "4 4"], k: list[Any]) -> str:
        """The token of a calibration, which is written where there is no such row yet."""
        sensor = {"token": token(channel), "channel": channel, "modality": modality}
        if sensor not in self.rows["sensor"]:
            self.rows["sensor"].append(sensor)
        row = {"sensor_token": sensor["token"], **_pose(pose), "camera_intrinsic": k}
        for known in self.rows["calibrated_sensor"][-1:]:
            same = known["sensor_token"] == sensor["token"] and known["camera_intrinsic"] == k
            near = (np.allclose(known[of], row[of], rtol=0, atol=1e-9) for of in ("translation", "rotation"))
            if same and all(near):
                return known["token"]
        own = token(self.log.name, channel, len(self.rows["calibrated_sensor"]))
        self.rows["calibrated_sensor"].append({"token": own, **row})
        return own

    def _shot(
        self, channel: str, mounted: str, time_s: float, ego: Float[np.ndarray, "4 4"], key: bool, suffix: str
    ) -> dict[str, Any]:
        stamp = self._stamp(time_s)
        own = token(self.log.name, channel, stamp)
        self.rows["ego_pose"].append({"token": own, "timestamp": stamp, **_pose(ego)})
        near = int(np.abs(self.log.times_s - time_s).argmin())
        name = f"{plain_name(self.log.name)}__{plain_name(channel)}__{stamp}.{plain_name(suffix)}"
        return {
            "token": own,
            "sample_token": self.samples[near],
            "ego_pose_token": own,
            "calibrated_sensor_token": mounted,
            "timestamp": stamp,
            "fileformat": suffix,
            "is_key_frame": key,
            "filename": f"{'samples' if key else 'sweeps'}/{plain_name(channel)}/{name}",
        }

    def _place(self, name: str) -> Path:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def _track(self, track: BoxTrack) -> None:
        category = self._named("category", track.category)
        used = {row["token"] for row in self.rows["instance"]}
        own = token(self.log.name, track.id) if track.id in used else track.id
        rows: list[dict[str, Any]] = []
        for k, t in enumerate(track.times_s):
            step = int(np.abs(self.log.times_s - t).argmin())
            if abs(self.log.times_s[step] - t) > 1e-3:
                raise ValueError(f"nuScenes: box {track.id} at {t:g} s, which is no labelled time")
            length, width, height = track.size_lwh_m[k].tolist()
            rows.append(
                {
                    "token": token(self.log.name, track.id, step),
                    "sample_token": self.samples[step],
                    "instance_token": own,
                    "visibility_token": str(int(track.visibility[k]) or _UNKNOWN),
                    "attribute_tokens": [self._named("attribute", name) for name in track.attributes[k]],
                    **_pose(track.world_from_box[k]),
                    "size": [width, length, height],
                    "num_lidar_pts": int(track.lidar_points[k]),
                    "num_radar_pts": 0,
                }
            )
        self.rows["sample_annotation"] += chained(rows)
        self.rows["instance"].append(
            {
                "token": own,
                "category_token": category,
                "nbr_annotations": len(rows),
                "first_annotation_token": rows[0]["token"],
                "last_annotation_token": rows[-1]["token"],
            }
        )

    def _named(self, table: str, name: str) -> str:
        own = token(table, name)
        if all(row["token"] != own for row in self.rows[table]):
            self.rows[table].append({"token": own, "name": name, "description": ""})
        return own


def chained(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows that know the one before and the one after."""
    for row in rows:
        row |= {"prev": "", "next": ""}
    for one, other in pairwise(rows):
        one["next"], other["prev"] = other["token"], one["token"]
    return rows


def write_points(path: Path, points: Float[np.ndarray, "n 3"]) -> None:
    """Points as ``.pcd.bin``: five float32 each, the last two intensity and ring, which are 0."""
    five = np.zeros((len(points), 5), np.float32)
    five[:, :3] = points
    path.write_bytes(five.tobytes())


def _pose(pose: Float[np.ndarray, "4 4"]) -> dict[str, list[float]]:
    turned = Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True, canonical=True)
    return {"translation": pose[:3, 3].tolist(), "rotation": turned.tolist()}
