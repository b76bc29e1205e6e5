"""A street seen from above as labels: road, dividers and road users in cells, exact to the original's.

The frames, layers, roundings and names that match are those of bradyz/cross_view_transformers, whose labels
are those of all published figures on nuScenes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Int32, UInt8

from dreamdrive.scene.camera import check_rigid
from dreamdrive.scene.street.log import LogMap, Polygon
from dreamdrive.tasks.perception.grid import BevGrid

AREAS = ("lane", "road_segment")
LINES = ("road_divider", "lane_divider")
ROAD_USERS = ("car", "truck", "bus", "trailer", "construction", "pedestrian", "motorcycle", "bicycle")
LAYERS = (*AREAS, *LINES, *ROAD_USERS)
"""The twelve layers in the order of their bits."""
VEHICLES = tuple(LAYERS.index(each) for each in ROAD_USERS if each != "pedestrian")
ROAD = tuple(LAYERS.index(each) for each in AREAS)
NO_VEHICLE = 255
"""Visibility of a cell without a vehicle; it counts as visible."""
_GUARD = 1e-6


@dataclass(frozen=True)
class Annotation:
    """A labelled box at one time.

    Attributes:
        category: In the words of nuScenes, such as ``vehicle.car``.
        world_from_box: The origin is the middle of the box; x ahead, y left, z up; metres.
        size_lwh_m: Length, width and height.
        visibility: Share that all cameras together see: 1 below 40 %, 2 to 60, 3 to 80, 4 above. 0 is
            unknown; losses and figures leave such cells out as those below 40 %.
    """

    category: str
    world_from_box: Float[np.ndarray, "4 4"]
    size_lwh_m: Float[np.ndarray, " 3"]
    visibility: int

    def __post_init__(self) -> None:
        check_rigid(self.world_from_box, f"the box of a {self.category}")

    @property
    def layer(self) -> int | None:
        """Which of ``LAYERS`` it belongs to: the first that is one of the words of its category.

        None for what has no layer. Emergency vehicles have none, so that labels of vehicles lack them;
        ``BevLabels.auxiliary`` has them. So it is in the original.
        """
        words = self.category.split(".")
        return next((LAYERS.index(user) for user in ROAD_USERS if user in words), None)


@dataclass(frozen=True)
class BevLabels:
    """What is in each cell.

    Attributes:
        layers: 1 where there is what ``LAYERS`` says, else 0.
        visibility: That of the vehicle in the cell; ``NO_VEHICLE`` without one.
        auxiliary: Of vehicles of all kinds, the last one that is listed where they overlap: 255 in it; how
            near its centre is, exp(-d²) at d cells; column and row of the centre less those of the cell;
            its forward direction as column and row, of length 1; half its length and half its width in
            cells. All 0 outside.
    """

    layers: UInt8[np.ndarray, "12 rows columns"]
    visibility: UInt8[np.ndarray, "rows columns"]
    auxiliary: Float[np.ndarray, "rows columns 8"]

    def bits(self) -> Int32[np.ndarray, "rows columns"]:
        """All layers in one image; bit i is layer i."""
        weights = 1 << np.arange(len(LAYERS), dtype=np.int32)
        return np.tensordot(weights, self.layers.astype(np.int32), axes=1).astype(np.int32)

    def vehicle(self) -> UInt8[np.ndarray, "rows columns"]:
        """1 where there is a vehicle of a kind that has a layer."""
        return self.layers[list(VEHICLES)].max(axis=0)

    def road(self) -> UInt8[np.ndarray, "rows columns"]:
        """1 where there is a lane or a road segment."""
        return self.layers[list(ROAD)].max(axis=0)

    def centre(self) -> Float[np.ndarray, "rows columns"]:
        """How near the centre of the vehicle in the cell is, in [0, 1]; 0 without one."""
        return self.auxiliary[..., 1]


def flat_pose(world_from_ego: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
    """The pose of the car made level: its heading and its position, in metres.

    The heading is the last of three turns about x, y and z, in this order, and numbers are those of float32:
    labels on the border between two cells depend on it. On a level road it is the usual one.
    """
    flat = np.eye(4)
    flat[:2, :2] = _heading(world_from_ego)
    flat[:3, 3] = world_from_ego[:3, 3]
    return _as_float32(flat)


def bev_labels(
    grid: BevGrid, world_from_ego: Float[np.ndarray, "4 4"], annotations: Sequence[Annotation], map: LogMap
) -> BevLabels:
    """Draw boxes and a map into the cells around a car.

    Args:
        grid: The cells.
        world_from_ego: Where the car is; it may be tilted.
        annotations: Boxes at this time.
        map: Areas and lines in the plane of the world; layers that ``LAYERS`` does not name are left out.
    """
    pixels_from_world = _pixels_from_world(grid, world_from_ego)
    size = grid.rows, grid.columns
    layers = np.zeros((len(LAYERS), *size), np.uint8)
    for index, name in enumerate(AREAS):
        for polygon in map.areas.get(name, ()):
            _draw_area(layers[index], polygon, pixels_from_world)
    for index, name in enumerate(LINES, start=len(AREAS)):
        lines = [_cells(_in_plane(line), pixels_from_world) for line in map.lines.get(name, ())]
        cv2.polylines(layers[index], lines, False, 1)
    for each in annotations:
        if each.layer is not None:
            cv2.fillPoly(layers[each.layer], [_cells(_bottom(each), pixels_from_world)], 1)
    return BevLabels(layers, *_vehicles(size, annotations, pixels_from_world))


def _pixels_from_world(grid: BevGrid, world_from_ego: np.ndarray) -> Float[np.ndarray, "3 4"]:
    """From (x, y, z, 1) to (column, row, 1); the height is dropped."""
    turned = _heading(world_from_ego).T
    inverse = np.eye(4)
    inverse[:2, :2] = turned
    inverse[:2, 3] = -turned @ _as_float32(world_from_ego[:2, 3])
    return grid.pixels_from_ego() @ _as_float32(inverse)[[0, 1, 3]]


def _heading(world_from_ego: np.ndarray) -> Float[np.ndarray, "2 2"]:
    yaw = np.arctan2(-world_from_ego[0, 1], world_from_ego[0, 0])
    return np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])


def _as_float32(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float32).astype(np.float64)


def _places(points: Float[np.ndarray, "n 3"], pixels_from_world: np.ndarray) -> Float[np.ndarray, "n 2"]:
    return points @ pixels_from_world[:2, :3].T + pixels_from_world[:2, 3]


def _cells(points: Float[np.ndarray, "n 3"], pixels_from_world: np.ndarray) -> Int32[np.ndarray, "n 2"]:
    """Nearest cells, halves to even ones."""
    return _places(points, pixels_from_world).round().astype(np.int32)


def _in_plane(points: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
    return np.column_stack([points, np.zeros(len(points))])


def _draw_area(layer: np.ndarray, polygon: Polygon, pixels_from_world: np.ndarray) -> None:
    """Fill an outline, then erase its holes, and with them what earlier areas drew there, as the original."""
    cv2.fillPoly(layer, [_cells(_in_plane(polygon.outline), pixels_from_world)], 1)
    for hole in polygon.holes:
        cv2.fillPoly(layer, [_cells(_in_plane(hole), pixels_from_world)], 0)


def _bottom(annotation: Annotation) -> Float[np.ndarray, "4 3"]:
    """Corners of the bottom in the world: ahead right, ahead left, behind left, behind right."""
    signs = np.array([[1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, -1]])
    pose = annotation.world_from_box
    return (signs * annotation.size_lwh_m / 2) @ pose[:3, :3].T + pose[:3, 3]


def _vehicles(
    size: tuple[int, int], annotations: Sequence[Annotation], pixels_from_world: np.ndarray
) -> tuple[UInt8[np.ndarray, "rows columns"], Float[np.ndarray, "rows columns 8"]]:
    """Visibility and auxiliary maps."""
    visibility = np.full(size, NO_VEHICLE, np.uint8)
    auxiliary = np.zeros((*size, 8), np.float32)
    for inside, corners, each in _covered(size, annotations, pixels_from_world):
        centre = corners.mean(axis=0)
        ahead, aside = corners[:2].mean(axis=0) - centre, corners[[0, 3]].mean(axis=0) - centre
        half_length, half_width = np.linalg.norm(ahead), np.linalg.norm(aside)
        rows, columns = np.nonzero(inside)
        offset = (centre - np.column_stack([columns, rows])).astype(np.float32)
        auxiliary[inside, 0] = 255
        auxiliary[inside, 1] = np.exp(-np.square(offset).sum(axis=1))
        auxiliary[inside, 2:4] = offset
        auxiliary[inside, 4:] = [*(ahead / (half_length + _GUARD)), half_length, half_width]
        visibility[inside] = each.visibility
    return visibility, auxiliary


def _covered(
    size: tuple[int, int], annotations: Sequence[Annotation], pixels_from_world: np.ndarray
) -> Iterator[tuple[np.ndarray, Float[np.ndarray, "4 2"], Annotation]]:
    """Cells and corners of each vehicle that covers any."""
    for each in annotations:
        if each.category.startswith("vehicle."):
            corners = _places(_bottom(each), pixels_from_world)
            drawn = np.zeros(size, np.uint8)
            cv2.fillPoly(drawn, [corners.round().astype(np.int32)], 1)
            if drawn.any():
                yield drawn > 0, corners, each
