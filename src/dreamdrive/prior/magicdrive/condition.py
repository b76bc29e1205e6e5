"""From a layout to what MagicDrive's networks read."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Int
from torch import Tensor

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
class Conditions:
    """What time steps shall show; b time steps, n cameras, k boxes at most.

    Attributes:
        raster: The map around the car (0 or 1), right and forward.
        cameras: Intrinsics in pixels of the full picture, camera to LiDAR in metres.
        corners_m: Corners of the boxes in the LiDAR frame as the networks were taught, 0 where no box is.
        classes: Classes of the boxes, 0 where no box is.
        present: Whether there is a box.
        text: Tokens of the words.
    """

    raster: Float[Tensor, "b c x y"]
    cameras: Float[Tensor, "b n 3 7"]
    corners_m: Float[Tensor, "b n k 8 3"]
    classes: Int[Tensor, "b n k"]
    present: Bool[Tensor, "b n k"]
    text: Float[Tensor, "b l e"]

    def without(
        self, null_camera: Float[Tensor, "3 7"], no_words: Float[Tensor, "b l e"], *, zero_map: bool = False
    ) -> "Conditions":
        """Those of the unconditional branch: no words, no camera, no boxes; the map stays, unless told."""
        return replace(
            self,
            raster=torch.zeros_like(self.raster) if zero_map else self.raster,
            cameras=null_camera.expand_as(self.cameras),
            corners_m=torch.zeros_like(self.corners_m),
            classes=torch.zeros_like(self.classes),
            present=torch.zeros_like(self.present),
            text=no_words,
        )


def see(
    layout: Layout, times_s: Float[np.ndarray, " t"], cells: int, words: Float[Tensor, "1 l e"]
) -> Conditions:
    """What the cameras are told at given times of the layout, on the device of the words' tokens.

    Each camera has its list of boxes, filled up to the longest list of all; all numbers are rounded to half
    precision, in which the networks were taught: sine of 8 times a focal length tells the difference. The
    raster has ``cells`` along each side.
    """
    lidar_from_car = np.linalg.inv(car_from_lidar())
    lidar_from_camera = np.stack([lidar_from_car @ car_from_camera(each) for each in NUSCENES])
    count = len(times_s)
    shape = (count, len(NUSCENES), len(layout.boxes))
    corners, classes = np.zeros((*shape, 8, 3)), np.zeros(shape, dtype=np.int64)
    present, rasters = np.zeros(shape, dtype=bool), list[np.ndarray]()
    for step, (time_s, car) in enumerate(zip(times_s, map_from_car(layout.ego, times_s), strict=True)):
        lidar_from_map = lidar_from_car @ np.linalg.inv(car)
        rasters.append(draw_map(layout, lidar_from_map, cells))
        places, kinds = layout_boxes(layout, lidar_from_map, float(time_s))
        told = as_published(places)
        for camera, mask in enumerate(listed(places, np.linalg.inv(lidar_from_camera))):
            own = (step, camera, slice(mask.sum()))
            corners[own], classes[own], present[own] = told[mask], kinds[mask], True
    longest = present.sum(axis=-1).max(initial=0)
    intrinsics = np.stack([full_intrinsics(each) for each in NUSCENES])
    matrices = np.concatenate([intrinsics, lidar_from_camera[:, :3]], axis=-1)
    given = (
        np.stack(rasters),
        _rounded(np.repeat(matrices[None], count, axis=0)),
        _rounded(corners[:, :, :longest]),
        classes[:, :, :longest],
        present[:, :, :longest],
    )
    tensors = [torch.from_numpy(np.ascontiguousarray(each)).to(words.device) for each in given]
    return Conditions(*tensors, text=words.expand(count, -1, -1))


def _rounded(values: np.ndarray) -> Float32[np.ndarray, "..."]:
    return values.astype(np.float16).astype(np.float32)


def prompt_of(description: str | None) -> str:
    """The sentence that the networks were taught with."""
    words = (DESCRIPTION if description is None else description).strip().rstrip(".")
    return f"A driving scene image at {LOCATION}. {words}."
