"""The truth of a drive that was drawn: frames, and what is known exactly of their pixels and road users."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal, get_args

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.street.layout import Layout
from dreamdrive.scene.trajectory import Trajectory

Mount = Literal["front", "front_left", "front_right", "back", "back_left", "back_right"]
MOUNTS: tuple[Mount, ...] = get_args(Mount)
"""The cameras of the car, the front one first."""


class Semantic(IntEnum):
    """Class of a pixel."""

    SKY = 0
    ROAD = 1
    MARKING = 2
    SIDEWALK = 3
    GRASS = 4
    BUILDING = 5
    VEGETATION = 6
    POLE = 7
    SIGN = 8
    CAR = 9
    VAN = 10
    TRUCK = 11
    BICYCLE = 12
    PEDESTRIAN = 13
    BUS = 14
    MOTORCYCLE = 15
    WALL = 16
    OWN_CAR = 17


@dataclass(frozen=True)
class WorldBox:
    """The hull of a road user: its name and kind in the layout, and whether it ever moves.

    ``instance`` is the label of its pixels, from 1. Its size is that along x (ahead), y (left) and z (up);
    its pose is that of its centre (F, 4, 4) at each frame.
    """

    instance: int
    id: str
    kind: str
    moving: bool
    size_m: Float[np.ndarray, "3"]
    world_from_box: Float[np.ndarray, "f 4 4"]


@dataclass(frozen=True)
class DriveTruth:
    """One camera's drive; world = the camera of the first frame, metres. Truth is that of pixel centres.

    Arrays hold a picture a frame (F, H, W): depth along z, 0 in the sky; instances, 0 for none and otherwise
    :attr:`WorldBox.instance`; classes of ``Semantic``; pixels of moving road users; the way of each point to
    its place in the next frame, the last to one not drawn. Times start at 0. ``world_from_map`` is the pose
    of the layout's frame.
    """

    frames: UInt8[np.ndarray, "f h w 3"]
    times_s: Float[np.ndarray, " f"]
    cameras: tuple[Camera, ...]
    depth_m: Float[np.ndarray, "f h w"]
    instance: Int[np.ndarray, "f h w"]
    semantic: UInt8[np.ndarray, "f h w"]
    moving: Bool[np.ndarray, "f h w"]
    flow_px: Float[np.ndarray, "f h w 2"]
    boxes: tuple[WorldBox, ...]
    ground: Ground
    layout: Layout
    world_from_map: Float[np.ndarray, "4 4"]

    @property
    def sky(self) -> Bool[np.ndarray, "f h w"]:
        """Sky masks (F, H, W)."""
        return self.semantic == Semantic.SKY

    @property
    def trajectory(self) -> Trajectory:
        """The path of the camera."""
        return Trajectory(np.stack([c.world_from_camera for c in self.cameras]), self.times_s)
