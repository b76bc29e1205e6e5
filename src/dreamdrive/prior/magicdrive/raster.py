"""The map of a layout as MagicDrive sees it: one raster a channel, around the LiDAR."""

import cv2
import numpy as np
from jaxtyping import Float, Float32

from dreamdrive.errors import InputError
from dreamdrive.scene.layout import AreaKind, Layout, LineKind

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
"""In the network's order. Layouts have no road blocks: that channel is always empty."""
RANGE_M = 100.0
"""Side of the square."""
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
"""Which channel a line is drawn in; nuScenes has no line along the edge of the road."""
_LINE_CELLS = 2
"""Width of a line, as the devkit of nuScenes draws it."""


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
            cv2.polylines(layers[channel], [placed(line.points)], False, 1, _LINE_CELLS)
    return np.stack([layers[name] for name in CHANNELS]).astype(np.float32)
