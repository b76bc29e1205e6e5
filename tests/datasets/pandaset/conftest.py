"""A small PandaSet: one sequence of four frames, six cameras, three things and a lidar."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dreamdrive.datasets.pandaset.log import CAMERAS
from tests.data.textures import texture
from tests.datasets.pandaset.pickles import write_table

COUNT, START_S = 4, 1_557_539_956.5
EGO_FROM_LIDAR = np.array([[0.0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0.33], [0, 0, 0, 1]])
"""The pose of PandaSet's lidar: x to the right, y ahead."""
CAMERA_AXES = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
YAWS = dict(zip(CAMERAS, (0.0, 57.0, -57.0, 90.0, 180.0, -90.0), strict=True))


def ego_from_camera(name: str) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("z", YAWS[name], degrees=True).as_matrix() @ CAMERA_AXES
    pose[:3, 3] = [0.85, 0.0, 2.14] if name == "front_camera" else [0.5, 0.3, 1.9]
    return pose


def ego_at(time_s: float) -> np.ndarray:
    """A drive at 10 m/s that turns left, over a slope of 3 degrees."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("ZY", [0.7 + 0.2 * time_s, np.deg2rad(-3)]).as_matrix()
    pose[:3, 3] = [10 * time_s, 5.0, 1.0]
    return pose


def listed(poses: list[np.ndarray]) -> list[dict[str, Any]]:
    made = []
    for pose in poses:
        w, x, y, z = Rotation.from_matrix(pose[:3, :3]).as_quat(scalar_first=True).tolist()
        place = dict(zip("xyz", pose[:3, 3].tolist(), strict=True))
        made.append({"position": place, "heading": {"w": w, "x": x, "y": y, "z": z}})
    return made


def cuboid(uuid: str, label: str, x: float, **more: Any) -> dict[str, Any]:
    row = {
        "uuid": uuid,
        "label": label,
        "yaw": -np.pi / 2,
        "stationary": False,
        "camera_used": -1,
        "position.x": x,
        "position.y": 8.0,
        "position.z": 1.5,
        "dimensions.x": 1.9,
        "dimensions.y": 4.5,
        "dimensions.z": 1.6,
        "attributes.object_motion": "Moving",
        "cuboids.sibling_id": "-",
        "cuboids.sensor_id": -1,
        "attributes.rider_status": np.nan,
        "attributes.pedestrian_behavior": np.nan,
        "attributes.pedestrian_age": np.nan,
    }
    return row | {key.replace("__", "."): value for key, value in more.items()}


def cuboids(step: int) -> list[dict[str, Any]]:
    """A car that both lidars see, at the first time the front one only; a child; a parked truck."""
    front = cuboid("front", "Car", 20 + step, cuboids__sensor_id=1, cuboids__sibling_id="main")
    main = cuboid("main", "Car", 20.2 + step, cuboids__sensor_id=0, cuboids__sibling_id="front")
    child = cuboid(
        "child",
        "Pedestrian with Object",
        5,
        attributes__object_motion=np.nan,
        attributes__pedestrian_age="Child",
        attributes__pedestrian_behavior="Standing",
    )
    truck = cuboid("truck", "Pickup Truck", 30, stationary=True, attributes__object_motion="Parked")
    return [front, *([main] if step else []), child, truck]


def write_cuboids(path: Path, rows: list[dict[str, Any]], new: bool = False) -> None:
    write_table(path, {name: _column([row[name] for row in rows]) for name in rows[0]}, new)


def _column(values: list[Any]) -> np.ndarray:
    kinds = {type(value) for value in values}
    return np.array(values) if kinds <= {bool} or kinds <= {int, float} else np.array(values, dtype=object)


@dataclass(frozen=True)
class Small:
    """Where it lies, and the true drive."""

    root: Path
    times_s: np.ndarray = field(default_factory=lambda: np.arange(COUNT) * 0.1)

    @property
    def sequence(self) -> Path:
        return self.root / "001"


@pytest.fixture
def small(tmp_path: Path) -> Small:
    return write_small(tmp_path / "PandaSet")


def write_small(root: Path) -> Small:
    made = Small(root)
    rng = np.random.default_rng(0)
    for number, name in enumerate(CAMERAS):
        folder = made.sequence / "camera" / name
        folder.mkdir(parents=True)
        times_s = made.times_s + 0.01 * number
        for step in range(COUNT):
            assert cv2.imwrite(str(folder / f"{step:02d}.jpg"), texture(48, 64, step))
        (folder / "intrinsics.json").write_text(json.dumps({"fx": 60.0, "fy": 61.0, "cx": 31.5, "cy": 23.0}))
        write_track(folder, [ego_at(t) @ ego_from_camera(name) for t in times_s], times_s)
    lidar = made.sequence / "lidar"
    lidar.mkdir()
    write_track(lidar, [ego_at(t) @ EGO_FROM_LIDAR for t in made.times_s], made.times_s)
    for step in range(COUNT):
        points = {name: rng.normal(size=50) for name in ("x", "y", "z", "i", "t")}
        write_table(lidar / f"{step:02d}.pkl.gz", points | {"d": np.zeros(50, int)})
        write_cuboids(made.sequence / "annotations" / "cuboids" / f"{step:02d}.pkl.gz", cuboids(step))
    return made


def write_track(folder: Path, poses: list[np.ndarray], times_s: np.ndarray) -> None:
    (folder / "poses.json").write_text(json.dumps(listed(poses)))
    (folder / "timestamps.json").write_text(json.dumps((START_S + np.asarray(times_s)).tolist()))
