"""Conditions of MagicDrive from a street: its map as a raster, its road users as corners, words."""

from dataclasses import dataclass, field, replace
from typing import Protocol, runtime_checkable

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Int
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.prior.magicdrive.cameras import Ring, map_from_car, typical_ring
from dreamdrive.scene.level import upright
from dreamdrive.scene.street.layout import AreaKind, BoxKind, Layout, LineKind, track_function

LOCATION = "boston-seaport"
"""Where nuScenes was recorded that drives on the right, as drawn streets do."""
DESCRIPTION = "City street, parked cars, houses, sunny"
"""What is seen unless told, in the manner of nuScenes' descriptions."""
CLASSES = (
    "car",
    "truck",
    "construction_vehicle",
    "bus",
    "trailer",
    "barrier",
    "motorcycle",
    "bicycle",
    "pedestrian",
    "traffic_cone",
)
"""Of boxes, in the order of the network's class tokens."""
KINDS: dict[BoxKind, str] = {
    "car": "car",
    "van": "car",  # nuScenes counts vans among the cars
    "truck": "truck",
    "bicycle": "bicycle",
    "pedestrian": "pedestrian",
    "bus": "bus",
    "motorcycle": "motorcycle",
}
_UNIT = np.array(
    [[1, -1, 0], [1, -1, 1], [-1, -1, 1], [-1, -1, 0], [1, 1, 0], [1, 1, 1], [-1, 1, 1], [-1, 1, 0]]
) * [0.5, 0.5, 1.0]
"""Corners in the network's order, of a box that stands on its origin: x ahead, y left, z up."""
CHANNELS = (
    "drivable_area",
    "ped_crossing",
    "walkway",
    "stop_line",
    "carpark_area",
    "road_divider",
    "lane_divider",
    "road_block",
)
"""Of the raster, in the network's order. Layouts have no road blocks: that channel is always empty."""
RANGE_M = 100.0
"""Side of the square around the LiDAR that the raster shows."""
AREAS: dict[AreaKind, tuple[str, ...]] = {
    "road": ("drivable_area",),
    "crossing": ("drivable_area", "ped_crossing"),
    "parking": ("drivable_area", "carpark_area"),
    "sidewalk": ("walkway",),
    "grass": (),
}
"""Which channels an area fills; it clears those of other areas, since later areas lie on earlier ones."""
LINES: dict[LineKind, str | None] = {
    "lane_divider": "lane_divider",
    "road_divider": "road_divider",
    "stop_line": "stop_line",
    "road_edge": None,
}
"""Which channel a line is drawn in; nuScenes has none along the edge of the road."""
LINE_CELLS = 2
"""Width of a line, as the devkit of nuScenes draws it."""


@runtime_checkable
class StreetCondition(Protocol):
    """A street and the car in it, as the networks are told of them."""

    @property
    def ring(self) -> Ring:
        """The cameras of the car and its LiDAR."""
        ...

    def world_from_car(self, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 4 4"]:
        """Where the car is."""
        ...

    def boxes(
        self, lidar_from_world: Float[np.ndarray, "4 4"], time_s: float
    ) -> tuple[Float[np.ndarray, "b 8 3"], Int[np.ndarray, " b"]]:
        """True corners of all boxes at a time, and their classes."""
        ...

    def raster(self, lidar_from_world: Float[np.ndarray, "4 4"], cells: int) -> Float32[np.ndarray, "8 x y"]:
        """The map around the LiDAR, 0 or 1; rows go from left to right of the car, columns to the front."""
        ...


@dataclass(frozen=True)
class OfLayout:
    """The street of a layout, with typical cameras of nuScenes on its path."""

    layout: Layout
    ring: Ring = field(default_factory=typical_ring)

    def world_from_car(self, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "t 4 4"]:
        """Where the car is in the layout."""
        return map_from_car(self.layout.ego, times_s)

    def boxes(
        self, lidar_from_world: Float[np.ndarray, "4 4"], time_s: float
    ) -> tuple[Float[np.ndarray, "b 8 3"], Int[np.ndarray, " b"]]:
        """See ``layout_boxes``."""
        return layout_boxes(self.layout, lidar_from_world, time_s)

    def raster(self, lidar_from_world: Float[np.ndarray, "4 4"], cells: int) -> Float32[np.ndarray, "8 x y"]:
        """See ``draw_map``."""
        return draw_map(self.layout, lidar_from_world, cells)


@dataclass(frozen=True)
class Conditions:
    """What time steps shall show; b time steps, n cameras, k boxes at most.

    The raster is the map around the car (0 or 1), right and forward. A camera is its intrinsics in pixels of
    the full picture, then camera to LiDAR in metres. Corners of boxes are in the LiDAR frame as the networks
    were taught; they and their classes are 0 where no box is present.
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
    street: StreetCondition, times_s: Float[np.ndarray, " t"], cells: int, words: Float[Tensor, "1 l e"]
) -> Conditions:
    """What the cameras are told at given times of the street, on the device of the words' tokens.

    Each camera has its list of boxes, filled up to the longest list of all; all numbers are rounded to half
    precision, in which the networks were taught: sine of 8 times a focal length tells the difference. The
    raster has ``cells`` along each side.
    """
    ring = street.ring
    lidar_from_camera, lidar_from_car = ring.lidar_from_camera, np.linalg.inv(ring.car_from_lidar)
    camera_from_lidar = np.linalg.inv(lidar_from_camera)
    rasters = list[np.ndarray]()
    lists = list[list[tuple[np.ndarray, np.ndarray]]]()
    for time_s, car in zip(times_s, street.world_from_car(times_s), strict=True):
        lidar_from_world = lidar_from_car @ np.linalg.inv(car)
        rasters.append(street.raster(lidar_from_world, cells))
        places, kinds = street.boxes(lidar_from_world, float(time_s))
        told = as_published(places)
        lists.append([(told[mask], kinds[mask]) for mask in listed(places, camera_from_lidar)])
    matrices = np.concatenate([ring.told, lidar_from_camera[:, :3]], axis=-1)
    corners, classes, present = _filled_up(lists)
    given = (
        np.stack(rasters),
        _rounded(np.repeat(matrices[None], len(times_s), axis=0)),
        _rounded(corners),
        classes,
        present,
    )
    tensors = [torch.from_numpy(np.ascontiguousarray(each)).to(words.device) for each in given]
    return Conditions(*tensors, text=words.expand(len(times_s), -1, -1))


def _filled_up(
    lists: list[list[tuple[np.ndarray, np.ndarray]]],
) -> tuple[Float[np.ndarray, "b n k 8 3"], Int[np.ndarray, "b n k"], Bool[np.ndarray, "b n k"]]:
    """Corners and classes of lists of one length, and where there are any."""
    longest = max(len(kinds) for cameras in lists for _, kinds in cameras)
    shape = len(lists), len(lists[0]), longest
    corners, classes = np.zeros((*shape, 8, 3)), np.zeros(shape, dtype=np.int64)
    present = np.zeros(shape, dtype=bool)
    for step, cameras in enumerate(lists):
        for camera, (places, kinds) in enumerate(cameras):
            own = (step, camera, slice(len(kinds)))
            corners[own], classes[own], present[own] = places, kinds, True
    return corners, classes, present


def _rounded(values: np.ndarray) -> Float32[np.ndarray, "..."]:
    return values.astype(np.float16).astype(np.float32)


def box_corners(
    lidar_from_box: Float[np.ndarray, "b 4 4"], size_m: Float[np.ndarray, "b 3"]
) -> Float[np.ndarray, "b 8 3"]:
    """Corners of boxes by the poses of the middle of their footprints, and length, width and height."""
    local = _UNIT * size_m[:, None]
    return local @ np.swapaxes(lidar_from_box[:, :3, :3], 1, 2) + lidar_from_box[:, None, :3, 3]


def layout_boxes(
    layout: Layout, lidar_from_map: Float[np.ndarray, "4 4"], time_s: float
) -> tuple[Float[np.ndarray, "b 8 3"], Int[np.ndarray, " b"]]:
    """True corners of all boxes at a time, and their classes."""
    places = [track_function(box.track)(np.array([time_s]))[0] for box in layout.boxes]
    poses = np.array([lidar_from_map @ upright(place) for place in places]).reshape(-1, 4, 4)
    sizes = np.array([box.size_m for box in layout.boxes], dtype=np.float64).reshape(-1, 3)
    classes = np.array([CLASSES.index(KINDS[box.kind]) for box in layout.boxes], dtype=np.int64)
    return box_corners(poses, sizes), classes


def as_published(corners_m: Float[np.ndarray, "b 8 3"]) -> Float[np.ndarray, "b 8 3"]:
    """Corners as the published networks were taught: half a box height too high.

    nuScenes tells the centre of a box, and the authors' data path takes it for the bottom.
    """
    raised = corners_m.copy()
    raised[..., 2] += 0.5 * np.ptp(corners_m[..., 2], axis=1, keepdims=True)
    return raised


def listed(
    corners_m: Float[np.ndarray, "b 8 3"], camera_from_lidar: Float[np.ndarray, "n 4 4"]
) -> Bool[np.ndarray, "n b"]:
    """Which camera lists which box: those with a true corner before it, inside the picture or not."""
    depth = np.einsum("nd,bkd->nbk", camera_from_lidar[:, 2, :3], corners_m)
    return (depth + camera_from_lidar[:, 2, 3, None, None] > 0).any(axis=-1)


def check_map(layout: Layout, name: str) -> None:
    """Refuse a map without a road, without which the pictures would show no street."""
    if not any(area.kind == "road" for area in layout.areas):
        raise InputError(f"{name}: no area is of kind road, which MagicDrive's map needs; add one to $.areas")


def draw_map(
    layout: Layout, lidar_from_map: Float[np.ndarray, "4 4"], cells: int
) -> Float32[np.ndarray, "8 x y"]:
    """The raster of one time step: areas and lines, 0 or 1 for each channel; nothing that moves is drawn.

    Rows go from left to right of the car, columns from back to front.
    """
    layers = {name: np.zeros((cells, cells), dtype=np.uint8) for name in CHANNELS}
    surfaces = {name for names in AREAS.values() for name in names}

    def placed(points: list[tuple[float, float]]) -> np.ndarray:
        across = np.asarray(points) @ lidar_from_map[:2, :2].T + lidar_from_map[:2, 3]
        pixels = np.round((across / RANGE_M + 0.5) * cells).astype(np.int32)
        return pixels[:, ::-1]  # OpenCV takes the column first, which is the way ahead

    for area in layout.areas:
        rings = [placed(ring) for ring in (area.polygon, *area.holes)]
        for name in surfaces:
            cv2.fillPoly(layers[name], rings, int(name in AREAS[area.kind]))
    for line in layout.lines:
        channel = LINES[line.kind]
        if channel is not None:
            cv2.polylines(layers[channel], [placed(line.points)], False, 1, LINE_CELLS)
    return np.stack([layers[name] for name in CHANNELS]).astype(np.float32)


def prompt_of(description: str | None, location: str = LOCATION) -> str:
    """The sentence that the networks were taught with."""
    words = (DESCRIPTION if description is None else description).strip().rstrip(".")
    return f"A driving scene image at {location}. {words}."
