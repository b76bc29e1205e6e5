"""The cameras of the own car."""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera, check_rigid
from dreamdrive.scene.scene import Scene

SIZE_PX = (320, 192)
"""Width and height of pictures unless told."""
_MOST_PIXELS, _LONGEST_PX = 16_000_000, 16_384
_CAMERA_FROM_EGO_AXES = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])


@dataclass(frozen=True)
class Mount:
    """A camera of the own car.

    Attributes:
        name: For people.
        pinhole: At the size of its pictures; its pose is not used.
        ego_from_camera: Its mounting. Ego frame: x ahead, y left, z up, on the ground under the middle of the
            rear axle; axes of a camera are x right, y down, z ahead.
        of_rig: The camera of the scene's rig whose exposure its pictures have.
    """

    name: str
    pinhole: Camera
    ego_from_camera: Float[np.ndarray, "4 4"]
    of_rig: int = 0

    def __post_init__(self) -> None:
        check_rigid(self.ego_from_camera, f"mounting of {self.name}")


def mount(
    name: str,
    at_m: tuple[float, float, float] = (1.7, 0.0, 1.5),
    left_deg: float = 0.0,
    down_deg: float = 0.0,
    hfov_deg: float = 64.0,
    size_px: tuple[int, int] = SIZE_PX,
) -> Mount:
    """A camera by where it is and where it looks.

    Args:
        name: For people.
        at_m: Ahead of the rear axle, to the left of the middle, above the ground.
        left_deg: How far to the left it looks.
        down_deg: How far down.
        hfov_deg: Its horizontal field of view.
        size_px: Width and height of its pictures.
    """
    check_size(size_px)
    if not 0 < hfov_deg < 170 or not np.isfinite([*at_m, left_deg, down_deg]).all():
        raise InputError(
            f"camera {name}: {hfov_deg:g} degrees, at {at_m}; expected a field of view up to 170 degrees and "
            "finite numbers"
        )
    (width, height), focal = size_px, 0.5 * size_px[0] / math.tan(math.radians(hfov_deg) / 2)
    turned = Rotation.from_euler("ZY", [left_deg, down_deg], degrees=True).as_matrix()
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turned @ _CAMERA_FROM_EGO_AXES, at_m
    return Mount(name, Camera(focal, focal, width / 2, height / 2, width, height), pose)


def check_size(size_px: object) -> None:
    """Raise ``InputError`` unless these are width and height of a picture."""
    sides = size_px if isinstance(size_px, tuple | list) else ()
    whole = all(isinstance(each, int | np.integer) and 1 <= each <= _LONGEST_PX for each in sides)
    if len(sides) != 2 or not whole or int(sides[0]) * int(sides[1]) > _MOST_PIXELS:
        raise InputError(
            f"size_px {size_px!r}; expected width and height, whole numbers from 1 to {_LONGEST_PX}, at most "
            f"{_MOST_PIXELS / 1e6:g} megapixels"
        )


def scene_rig(
    scene: Scene, ego_from_front: Float[np.ndarray, "4 4"], size_px: tuple[int, int], only_front: bool
) -> tuple[Mount, ...]:
    """The cameras that recorded a scene, the front one first, with pictures of one size.

    Args:
        scene: What they recorded.
        ego_from_front: Mounting of the first one.
        size_px: Width and height; each keeps its horizontal field of view and the shape of its pixels.
        only_front: Leave out all but the first.
    """
    index = np.zeros(len(scene.cameras), dtype=int) if scene.camera is None else scene.camera
    found: list[Mount] = []
    for camera in dict.fromkeys(index.tolist()):
        view = int(np.flatnonzero(index == camera)[0])
        front = scene.trajectory.at(scene.times_s[view : view + 1])[0]
        pose = ego_from_front @ np.linalg.inv(front) @ scene.cameras[view].world_from_camera
        name = f"camera {camera}" if found else "front"
        found.append(Mount(name, _sized(scene.cameras[view], size_px), pose, int(camera)))
    return tuple(found[:1] if only_front else found)


def _sized(camera: Camera, size_px: tuple[int, int]) -> Camera:
    scale = size_px[0] / camera.width_px
    return replace(camera.resized(*size_px), fx_px=camera.fx_px * scale, fy_px=camera.fy_px * scale)
