"""The six cameras and the LiDAR of a car, as MagicDrive is told of them.

A layout has no rig, and the network knows no other than that of nuScenes: typical values stand for it. They
are those of its calibrations, rounded: they differ a little from car to car, and their tilts of a degree or
less are left out. A scene of a data set has cameras of its own, see ``of_scene``.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.level import upright
from dreamdrive.scene.street.layout import Ego, track_function

FULL_SIZE = (1600, 900)
"""Width and height of the pictures that the intrinsics belong to."""


@dataclass(frozen=True)
class _Mounted:
    """A camera of the car, its intrinsics those of the full picture, its yaw from ahead to the left.

    The car's frame is x ahead, y left, z up, on the road below the rear axle.
    """

    name: str
    focal_px: float
    centre_px: tuple[float, float]
    place_m: tuple[float, float, float]
    yaw_deg: float


NUSCENES = (
    _Mounted("CAM_FRONT", 1266.0, (816.0, 491.0), (1.70, 0.0, 1.51), 0.0),
    _Mounted("CAM_FRONT_RIGHT", 1261.0, (808.0, 495.0), (1.55, -0.49, 1.50), -56.0),
    _Mounted("CAM_BACK_RIGHT", 1260.0, (807.0, 501.0), (1.01, -0.48, 1.56), -110.0),
    _Mounted("CAM_BACK", 809.0, (829.0, 482.0), (0.03, 0.0, 1.58), 180.0),
    _Mounted("CAM_BACK_LEFT", 1257.0, (792.0, 493.0), (1.04, 0.48, 1.59), 108.0),
    _Mounted("CAM_FRONT_LEFT", 1273.0, (827.0, 480.0), (1.52, 0.49, 1.51), 55.0),
)
"""Clockwise from the front camera. MagicDrive's own list starts one place earlier, at CAM_FRONT_LEFT; it is
the same ring, and the network knows cameras only by their neighbours and their matrices."""
LIDAR_PLACE_M = (0.94, 0.0, 1.84)
"""In the car's frame; the LiDAR's axes are x right, y ahead, z up."""
_LEVEL = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
"""Axes of a camera that looks ahead (x right, y down, z ahead) in the car's frame."""


def car_from_camera(camera: _Mounted) -> Float[np.ndarray, "4 4"]:
    """Pose of a camera in the car's frame."""
    pose = upright(np.array([*camera.place_m[:2], np.deg2rad(camera.yaw_deg)]))
    pose[:3, :3] = pose[:3, :3] @ _LEVEL
    pose[2, 3] = camera.place_m[2]
    return pose


def car_from_lidar() -> Float[np.ndarray, "4 4"]:
    """Pose of the LiDAR in the car's frame."""
    pose = upright(np.array([*LIDAR_PLACE_M[:2], -np.pi / 2]))
    pose[2, 3] = LIDAR_PLACE_M[2]
    return pose


def map_from_car(ego: Ego, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 4 4"]:
    """Poses of the car whose front camera follows the layout's path; the car stands level on the road."""
    ahead = NUSCENES[0].place_m[0]
    poses = np.stack([upright(place) for place in track_function(ego.track)(times_s)])
    poses[:, :3, 3] -= ahead * poses[:, :3, 0]
    return poses


@dataclass(frozen=True)
class Ring:
    """Cameras of a car, clockwise from one that looks ahead, and its LiDAR.

    Attributes:
        names: Of the cameras.
        told: Their intrinsics as the network is told them, those of the full picture whatever its own size
            is; the first pixel has its centre at 0.
        full: Their pinholes of the full picture; the first pixel has its centre at 0.5.
        car_from_camera: Their mountings.
        car_from_lidar: That of the LiDAR, whose axes are x right, y ahead, z up.
    """

    names: tuple[str, ...]
    told: Float[np.ndarray, "n 3 3"]
    full: tuple[Camera, ...]
    car_from_camera: Float[np.ndarray, "n 4 4"]
    car_from_lidar: Float[np.ndarray, "4 4"]

    @property
    def lidar_from_camera(self) -> Float[np.ndarray, "n 4 4"]:
        """Poses of the cameras, from the LiDAR."""
        return np.linalg.inv(self.car_from_lidar) @ self.car_from_camera

    def rig(self, size: tuple[int, int]) -> tuple[Camera, ...]:
        """Pinholes of the pictures that the network makes, their poses relative to the first camera."""
        scale, left, top = crop(size)
        mounted = np.linalg.inv(self.car_from_camera[0]) @ self.car_from_camera
        cameras = [
            Camera(
                each.fx_px * scale,
                each.fy_px * scale,
                each.cx_px * scale - left,
                each.cy_px * scale - top,
                *size,
                pose,
            )
            for each, pose in zip(self.full, mounted, strict=True)
        ]
        # The product of a pose with its inverse is the identity only up to rounding; say it exactly.
        return cameras[0].at(np.eye(4)), *cameras[1:]


def typical_ring() -> Ring:
    """The one that stands for the cars of nuScenes; half a pixel is less than what is rounded."""
    full = tuple(Camera(c.focal_px, c.focal_px, *c.centre_px, *FULL_SIZE) for c in NUSCENES)
    return Ring(
        names=tuple(each.name for each in NUSCENES),
        told=np.stack([each.matrix for each in full]),
        full=full,
        car_from_camera=np.stack([car_from_camera(each) for each in NUSCENES]),
        car_from_lidar=car_from_lidar(),
    )


def crop(size: tuple[int, int]) -> tuple[float, float, float]:
    """How pictures of the full size become the network's: scale, then pixels cut off on the left and on top.

    The bottom is kept and the sides are cut alike: 400x224 is a quarter of the full size without its first
    row, 800x424 half of it without 26 rows, 736x272 half of it without 178 rows and 32 columns on each side.
    """
    width, height = size
    scale = 0.5 if size == (736, 272) else width / FULL_SIZE[0]
    left, top = (FULL_SIZE[0] * scale - width) / 2, FULL_SIZE[1] * scale - height
    if top < 0:
        raise InputError(f"unet/config.json: img_size {height}x{width} is taller than 9/16 of its width")
    return scale, left, top
