"""Looks: what the street network says of pictures: depth, classes, road users, the camera."""

from dataclasses import dataclass
from math import atan, cos, tan

import numpy as np
from jaxtyping import Bool, Float, UInt8, UInt16

from dreamdrive.registry import shown
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.street_class import ROAD_USERS, StreetClass


@dataclass(frozen=True)
class CameraEstimate:
    """A pinhole as a picture suggests it, with standard deviations; the principal point is the middle.

    Attributes:
        width_px: Width of the picture.
        height_px: Its height.
        focal_px: Focal length.
        focal_spread: Standard deviation of its logarithm; 0 where it was given.
        horizon_px: Row at which level rays cross the middle column, counted downwards from the middle.
        horizon_spread_px: Standard deviation of it.
        roll_rad: How far the camera is turned clockwise, seen from behind it.
        roll_spread_rad: Standard deviation of it.
        distorted: Probability, in [0, 1], that straight lines are bent too much for a pinhole.
    """

    width_px: int
    height_px: int
    focal_px: float
    focal_spread: float
    horizon_px: float
    horizon_spread_px: float
    roll_rad: float
    roll_spread_rad: float
    distorted: float

    @property
    def hfov_rad(self) -> float:
        """Horizontal field of view."""
        return 2 * atan(0.5 * self.width_px / self.focal_px)

    @property
    def pitch_rad(self) -> float:
        """How far the camera looks up."""
        return atan(self.horizon_px * cos(self.roll_rad) / self.focal_px)

    def horizon_rows(self, columns_px: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Rows, from the top of the picture, at which level rays cross columns, from its left."""
        middle = self.height_px / 2 + self.horizon_px
        return middle - (columns_px - self.width_px / 2) * tan(self.roll_rad)

    def up_in(self, camera: Camera) -> Float[np.ndarray, "3"]:
        """Up from a level road (3,), of length 1, in the frame of a pinhole of the picture's size."""
        slope = tan(self.roll_rad)
        middle = self.height_px / 2 + self.horizon_px + slope * self.width_px / 2
        # The level plane through the camera is seen as the line of the horizon.
        up = -camera.matrix.T @ [slope, 1.0, -middle]
        return up / np.linalg.norm(up)


@dataclass(frozen=True)
class RoadUser:
    """One vehicle, two-wheeler or person in a frame.

    Attributes:
        kind: One of ``ROAD_USERS``.
        score: Trust in it, in (0, 1].
        box_px: First column and row, and last column and row + 1, of its pixels.
        pixels: How many these are.
    """

    kind: StreetClass
    score: float
    box_px: tuple[int, int, int, int]
    pixels: int

    def __post_init__(self) -> None:
        if self.kind not in ROAD_USERS:
            raise ValueError(f"road user: {self.kind.name} is none of {[each.name for each in ROAD_USERS]}")


@dataclass(frozen=True)
class Look:
    """What is seen in F frames of H x W pixels of one camera.

    Attributes:
        depth: Along z, in heights of the camera above the road (F, H, W); 0 in the sky. On the own
            car it is a guess: what is only taken for it keeps its depth.
        spread: Relative half width of the interval that holds the depth with 68 % (F, H, W); 0 without depth.
        classes: ``StreetClass`` of each pixel (F, H, W).
        confidence: Probability of that class, in [0, 1] (F, H, W).
        instances: 1 + index into ``road_users[frame]``, 0 where there is none (F, H, W).
        road_users: The vehicles, two-wheelers and persons of each frame.
        cameras: The camera as each frame alone suggests it.
        camera: The camera as all frames together do.
        camera_height_m: Height of the camera above the road, which makes metres of depth; None: not known.
        features: What the network computes its answers from (F, C, h, w), where it was asked for.
    """

    depth: Float[np.ndarray, "f h w"]
    spread: Float[np.ndarray, "f h w"]
    classes: UInt8[np.ndarray, "f h w"]
    confidence: Float[np.ndarray, "f h w"]
    instances: UInt16[np.ndarray, "f h w"]
    road_users: tuple[tuple[RoadUser, ...], ...]
    cameras: tuple[CameraEstimate, ...]
    camera: CameraEstimate
    camera_height_m: float | None = None
    features: Float[np.ndarray, "f c _ _"] | None = None

    def __post_init__(self) -> None:
        shape = self.depth.shape
        for name in ("spread", "classes", "confidence", "instances"):
            if getattr(self, name).shape != shape:
                raise ValueError(f"look: {name} of shape {getattr(self, name).shape}, expected {shape}")
        if not len(self.road_users) == len(self.cameras) == shape[0]:
            raise ValueError(
                f"look: road users of {len(self.road_users)} and cameras of {len(self.cameras)} frames, "
                f"expected {shape[0]}"
            )

    def __len__(self) -> int:
        return len(self.depth)

    def _repr_html_(self) -> str:
        return shown(self)

    @property
    def depth_m(self) -> Float[np.ndarray, "f h w"]:
        """Depth along z in metres (F, H, W).

        Raises:
            ValueError: The camera's height is not known: depth is up to scale.
        """
        if self.camera_height_m is None:
            raise ValueError("look: depth is in camera heights; give the camera's height for metres")
        return self.depth * np.float32(self.camera_height_m)

    @property
    def sky(self) -> Bool[np.ndarray, "f h w"]:
        """Sky masks (F, H, W)."""
        return self.classes == StreetClass.SKY

    @property
    def own_car(self) -> Bool[np.ndarray, "f h w"]:
        """Pixels of what is fixed to the camera (F, H, W)."""
        return self.classes == StreetClass.OWN_CAR
