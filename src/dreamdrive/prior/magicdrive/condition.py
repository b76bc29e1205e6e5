"""From a layout to what MagicDrive's networks read."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from dreamdrive.prior.magicdrive.boxes import as_published, layout_boxes, listed
from dreamdrive.prior.magicdrive.cameras import (
    NUSCENES,
    car_from_camera,
    car_from_lidar,
    full_intrinsics,
    map_from_car,
)
from dreamdrive.prior.magicdrive.raster import draw_map
from dreamdrive.scene.layout import Layout

LOCATION = "boston-seaport"
"""Where nuScenes was recorded that drives on the right, as drawn streets do."""
DESCRIPTION = "City street, parked cars, houses, sunny"
"""What is seen unless told, in the manner of nuScenes' descriptions."""


@dataclass(frozen=True)
class Seen:
    """Time steps of a layout; t steps, n cameras, k boxes at most.

    Attributes:
        raster: The map (0 or 1).
        cameras: Intrinsics of the full picture, camera to LiDAR.
        corners_m: Corners in the LiDAR frame as the networks were taught, 0 where no box is.
        classes: Classes, 0 where no box is.
        present: Whether there is a box.
    """

    raster: Float32[np.ndarray, "t c x y"]
    cameras: Float32[np.ndarray, "t n 3 7"]
    corners_m: Float32[np.ndarray, "t n k 8 3"]
    classes: Int[np.ndarray, "t n k"]
    present: Bool[np.ndarray, "t n k"]


def see(layout: Layout, times_s: Float[np.ndarray, " t"], cells: int) -> Seen:
    """What the cameras are told at given times.

    Each camera has its list of boxes, filled up to the longest list of all; all numbers are rounded to half
    precision, in which the networks were taught: sine of 8 times a focal length tells the difference.

    Args:
        layout: Map, boxes and path.
        times_s: Times of the layout.
        cells: Cells along each side of the raster.
    """
    lidar_from_car = np.linalg.inv(car_from_lidar())
    lidar_from_camera = np.stack([lidar_from_car @ car_from_camera(each) for each in NUSCENES])
    rasters: list[np.ndarray] = []
    lists: list[list[tuple[np.ndarray, np.ndarray]]] = []
    for time_s, car in zip(times_s, map_from_car(layout.ego, times_s), strict=True):
        lidar_from_map = lidar_from_car @ np.linalg.inv(car)
        rasters.append(draw_map(layout, lidar_from_map, cells))
        corners, classes = layout_boxes(layout, lidar_from_map, float(time_s))
        told = as_published(corners)
        masks = listed(corners, np.linalg.inv(lidar_from_camera))
        lists.append([(told[mask], classes[mask]) for mask in masks])
    matrices = [
        np.concatenate([full_intrinsics(each), pose[:3]], axis=1)
        for each, pose in zip(NUSCENES, lidar_from_camera, strict=True)
    ]
    cameras = np.repeat(np.stack(matrices)[None], len(times_s), axis=0)
    return Seen(np.stack(rasters), _rounded(cameras), *_filled(lists))


def _filled(
    lists: list[list[tuple[np.ndarray, np.ndarray]]],
) -> tuple[Float32[np.ndarray, "t n k 8 3"], Int[np.ndarray, "t n k"], Bool[np.ndarray, "t n k"]]:
    """Lists of corners and classes, by time step and camera, as arrays."""
    longest = max(len(classes) for cameras in lists for _, classes in cameras)
    shape = (len(lists), len(lists[0]), longest)
    corners, classes = np.zeros((*shape, 8, 3)), np.zeros(shape, dtype=np.int64)
    present = np.zeros(shape, dtype=bool)
    for step, cameras in enumerate(lists):
        for camera, (places, kinds) in enumerate(cameras):
            corners[step, camera, : len(kinds)] = places
            classes[step, camera, : len(kinds)] = kinds
            present[step, camera, : len(kinds)] = True
    return _rounded(corners), classes, present


def _rounded(values: np.ndarray) -> Float32[np.ndarray, "..."]:
    return values.astype(np.float16).astype(np.float32)


def prompt_of(description: str | None) -> str:
    """The sentence that the networks were taught with."""
    words = (DESCRIPTION if description is None else description).strip().rstrip(".")
    return f"A driving scene image at {LOCATION}. {words}."
