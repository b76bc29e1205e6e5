"""A small KITTI: a raw drive of four frames with boxes, and the same drive as an odometry sequence."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.data.textures import texture

COUNT, SIZE = 4, (64, 24)
DATE, DRIVE = "2011_09_26", "2011_09_26_drive_0001_sync"
LIDAR_FROM_IMU = np.eye(4)
LIDAR_FROM_IMU[:3, 3] = [-0.81, 0.32, -0.80]
CAMERA_FROM_LIDAR = np.eye(4)
CAMERA_FROM_LIDAR[:3, :3] = [[0, -1, 0], [0, 0, -1], [1, 0, 0]]
CAMERA_FROM_LIDAR[:3, 3] = [0, -0.08, -0.27]
RECTIFIED = np.eye(4)
RECTIFIED[:3, :3] = Rotation.from_euler("x", 0.5, degrees=True).as_matrix()
EGO_FROM_IMU = np.eye(4)
EGO_FROM_IMU[2, 3] = 0.93
EGO_FROM_LIDAR = EGO_FROM_IMU @ np.linalg.inv(LIDAR_FROM_IMU)
EGO_FROM_CAMERA_0 = EGO_FROM_LIDAR @ np.linalg.inv(RECTIFIED @ CAMERA_FROM_LIDAR)
BESIDE = {"00": 0.0, "01": 0.54, "02": -0.06, "03": 0.47}
"""How far to the right of camera 0 the cameras are."""
FOCAL, CX, CY = 50.0, 31.0, 11.5


def projection(name: str) -> np.ndarray:
    matrix = np.array([[FOCAL, 0, CX, 0], [0, FOCAL, CY, 0], [0, 0, 1.0, 0]])
    matrix[0, 3] = -FOCAL * BESIDE[name]
    return matrix


def camera_0_from(name: str) -> np.ndarray:
    pose = np.eye(4)
    pose[0, 3] = BESIDE[name]
    return pose


def line(name: str, values: object) -> str:
    return f"{name}: {' '.join(f'{v:.12e}' for v in np.ravel(np.asarray(values, float)))}\n"


@dataclass(frozen=True)
class Small:
    """Where both lie; the drive goes 1 m a frame to the north-east, at 49 degrees north."""

    root: Path

    @property
    def drive(self) -> Path:
        return self.root / "raw" / DATE / DRIVE

    @property
    def date(self) -> Path:
        return self.drive.parent

    @property
    def odometry(self) -> Path:
        return self.root / "odometry"

    @property
    def sequence(self) -> Path:
        return self.odometry / "sequences" / "04"


@pytest.fixture
def small(tmp_path: Path) -> Small:
    return write_small(tmp_path)


def write_small(root: Path) -> Small:
    made = Small(root)
    made.drive.mkdir(parents=True)
    write_calibration(made.date)
    for name in ("image_02", "image_03"):
        write_pictures(made.drive / name / "data", 10)
        write_stamps(made.drive / name, 0.01)
    oxts = made.drive / "oxts" / "data"
    oxts.mkdir(parents=True)
    for step in range(COUNT):
        north = step / np.sqrt(2)
        latitude = 49 + np.rad2deg(north / 6_378_137)
        longitude = 8.4 + np.rad2deg(north / 6_378_137 / np.cos(np.deg2rad(49)))
        row = [latitude, longitude, 116 + 0.1 * step, 0.01, -0.02, np.pi / 4, *([0] * 24)]
        (oxts / f"{step:010d}.txt").write_text(" ".join(f"{v:.14g}" for v in row) + "\n")
    write_stamps(oxts.parent, 0.0)
    write_sweeps(made.drive / "velodyne_points" / "data", 10)
    write_stamps(made.drive / "velodyne_points", 0.005)
    (made.drive / "tracklet_labels.xml").write_text(
        tracklets([tracklet("Car", 1, 3), tracklet("Cyclist", 0, 2)])
    )
    write_pictures(made.sequence / "image_2", 6)
    write_sweeps(made.sequence / "velodyne", 6)
    rows = {f"P{k}": projection(f"0{k}") for k in range(4)} | {"Tr": (RECTIFIED @ CAMERA_FROM_LIDAR)[:3]}
    (made.sequence / "calib.txt").write_text("".join(line(name, row) for name, row in rows.items()))
    (made.sequence / "times.txt").write_text("".join(f"{0.1 * step:e}\n" for step in range(COUNT)))
    (made.odometry / "poses").mkdir()
    text = "".join(" ".join(f"{v:.12e}" for v in pose[:3].ravel()) + "\n" for pose in camera_poses())
    (made.odometry / "poses" / "04.txt").write_text(text)
    return made


def camera_poses() -> list[np.ndarray]:
    """Camera 0 drives 1 m a frame and turns to the right."""
    poses = [np.eye(4) for _ in range(COUNT)]
    for step, pose in enumerate(poses):
        pose[:3, :3] = Rotation.from_euler("y", 0.1 * step).as_matrix()
        pose[:3, 3] = [0.05 * step, 0.0, step]
    return poses


def write_calibration(folder: Path) -> None:
    stamp = "calib_time: 09-Jan-2012 13:57:47\n"
    for name, pose in (("imu_to_velo", LIDAR_FROM_IMU), ("velo_to_cam", CAMERA_FROM_LIDAR)):
        text = stamp + line("R", pose[:3, :3]) + line("T", pose[:3, 3])
        (folder / f"calib_{name}.txt").write_text(text)
    rows = {"R_rect_00": RECTIFIED[:3, :3]}
    for name in BESIDE:
        rows |= {f"S_rect_{name}": np.array(SIZE), f"P_rect_{name}": projection(name)}
    text = "".join(line(name, row) for name, row in rows.items())
    (folder / "calib_cam_to_cam.txt").write_text(f"{stamp}corner_dist: 9.95e-02\n{text}")


def write_pictures(folder: Path, digits: int) -> None:
    folder.mkdir(parents=True)
    for step in range(COUNT):
        assert cv2.imwrite(str(folder / f"{step:0{digits}d}.png"), texture(SIZE[1], SIZE[0], step))


def write_sweeps(folder: Path, digits: int) -> None:
    folder.mkdir(parents=True)
    for step in range(COUNT):
        (folder / f"{step:0{digits}d}.bin").write_bytes(np.full((3, 4), step, "<f4").tobytes())


def write_stamps(folder: Path, late_s: float) -> None:
    stamps = [f"2011-09-26 13:02:{25 + late_s + 0.1 * step:012.9f}\n" for step in range(COUNT)]
    (folder / "timestamps.txt").write_text("".join(stamps))


def tracklet(kind: str, first: int, count: int, **more: object) -> str:
    """A box 10 m ahead of the lidar and 2 m to its left, which is turned by 0.2 radians."""
    told = {"tx": 10, "ty": 2, "tz": -1.7, "rx": 0, "ry": 0, "rz": 0.2, "occlusion": 0} | more
    pose = "".join(f"<{name}>{value}</{name}>" for name, value in told.items())
    return (
        f'<item class_id="1"><objectType>{kind}</objectType><h>1.5</h><w>1.8</w><l>4.2</l>'
        f"<first_frame>{first}</first_frame><poses><count>{count}</count><item_version>2</item_version>"
        f"{f'<item><state>2</state>{pose}</item>' * count}</poses><finished>1</finished></item>"
    )


def tracklets(items: Sequence[str], head: str = "<!DOCTYPE boost_serialization>") -> str:
    return (
        f'<?xml version="1.0" encoding="UTF-8" standalone="yes" ?>\n{head}\n'
        '<boost_serialization signature="serialization::archive" version="9"><tracklets class_id="0">'
        f"<count>{len(items)}</count><item_version>1</item_version>{''.join(items)}</tracklets>"
        "</boost_serialization>\n"
    )
