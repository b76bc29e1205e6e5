"""A small drive of two cameras, made up, with all that a log may hold."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from dreamdrive.export.nuscenes.writer import write_points
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.log import BoxTrack, LidarSweep, Log, LogCamera, LogMap, Polygon

START_US = 1_533_000_000_000_000
TIMES_S = np.array([0.0, 0.5, 1.0])
SHOTS_S = np.arange(-1, 12) / 10
_LOOK_AHEAD = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])


def pose(x: float, y: float, z: float, yaw: float) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3] = Rotation.from_euler("z", yaw).as_matrix()
    made[:3, 3] = x, y, z
    return made


def ego(time_s: float) -> np.ndarray:
    return pose(200 + 5 * time_s, 300 + time_s, 0.1, 0.2 + 0.05 * time_s)


def mounting(yaw: float) -> np.ndarray:
    made = pose(1.5, 0.2, 1.4, yaw)
    made[:3, :3] = made[:3, :3] @ _LOOK_AHEAD
    return made


def camera(folder: Path, name: str, yaw: float, late_s: float = 0.0) -> LogCamera:
    (folder / name).mkdir(parents=True)
    mounted, files, rng = mounting(yaw), [], np.random.default_rng(len(name))
    for number in range(len(SHOTS_S)):
        files.append(folder / name / f"{number:02d}.png")
        coarse = rng.integers(0, 255, (6, 8, 3), dtype=np.uint8)
        cv2.imwrite(str(files[-1]), cv2.resize(coarse, (64, 48), interpolation=cv2.INTER_CUBIC))
    times_s = np.round(SHOTS_S + late_s, 6)
    return LogCamera(
        name=name,
        files=tuple(files),
        times_s=times_s,
        world_from_camera=np.stack([ego(t) @ mounted for t in times_s]),
        ego_from_camera=mounted,
        pinhole=Camera(50.0, 51.0, 32.5, 23.5, 64, 48),
        key=np.isin(np.round(SHOTS_S, 6), TIMES_S),
    )


def single(camera: LogCamera, row: int) -> LogCamera:
    """The same camera with one of its pictures."""
    one = slice(row, row + 1)
    return replace(
        camera,
        files=camera.files[one],
        times_s=camera.times_s[one],
        world_from_camera=camera.world_from_camera[one],
        key=camera.key[one],
    )


def track(id: str, category: str, speed: float, times_s: np.ndarray = TIMES_S) -> BoxTrack:
    moves = speed > 0
    return BoxTrack(
        id=id,
        category=category,
        times_s=times_s,
        world_from_box=np.stack([pose(215 + speed * t, 303, 0.9, 0.3) for t in times_s]),
        size_lwh_m=np.tile([4.5, 1.9, 1.6], (len(times_s), 1)),
        visibility=np.array([1, 4, 0][: len(times_s)]),
        moves=np.full(len(times_s), int(moves)),
        lidar_points=np.arange(len(times_s)),
        attributes=(("vehicle.moving" if moves else "vehicle.parked",),) * len(times_s),
    )


def street() -> LogMap:
    road = np.array([[150.0, 295], [280, 295], [280, 315], [150, 315]])
    hole = np.array([[230.0, 300], [235, 300], [235, 305], [230, 305]])
    return LogMap(
        {"drivable_area": (Polygon(road, (hole,)),), "walkway": (Polygon(road + np.array([0, 20])),)},
        {"lane_divider": (np.array([[150.0, 305], [280, 305]]),)},
    )


def log(folder: Path, name: str = "scene-0001") -> Log:
    rng = np.random.default_rng(3)
    sweeps = []
    for number, time_s in enumerate(SHOTS_S):
        place = folder / f"{number:02d}.pcd.bin"
        folder.mkdir(parents=True, exist_ok=True)
        write_points(place, rng.normal(size=(20, 3)) * 10)
        lifted = pose(0.9, 0, 1.8, -np.pi / 2)
        sweeps.append(LidarSweep(place, float(np.round(time_s, 6)), ego(np.round(time_s, 6)) @ lifted))
    return Log(
        name=name,
        about="A street that is made up",
        location=f"nowhere-{name}",
        root=folder,
        cameras=(camera(folder, "CAM_FRONT", 0.0), camera(folder, "CAM_BACK_LEFT", 1.9, late_s=0.03)),
        times_s=TIMES_S,
        start_us=START_US,
        world_from_ego=np.stack([ego(t) for t in TIMES_S]),
        boxes=(
            track("car", "vehicle.car", 6.0),
            track("parked", "vehicle.truck", 0.0, TIMES_S[:2]),
            track("cone", "movable_object.trafficcone", 0.0),
        ),
        sweeps=tuple(sweeps),
        map=street(),
    )
