"""Road users of a layout as MagicDrive sees them: corners in the LiDAR frame, and a list for each camera."""

import numpy as np
from jaxtyping import Bool, Float, Int

from dreamdrive.scene.layout import BoxKind, Layout, track_function
from dreamdrive.world import upright

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
"""In the order of the network's class tokens."""
KINDS: dict[BoxKind, str] = {
    "car": "car",
    "van": "car",  # nuScenes counts vans among the cars
    "truck": "truck",
    "bicycle": "bicycle",
    "pedestrian": "pedestrian",
}
_UNIT = np.array(
    [[1, -1, 0], [1, -1, 1], [-1, -1, 1], [-1, -1, 0], [1, 1, 0], [1, 1, 1], [-1, 1, 1], [-1, 1, 0]]
) * [0.5, 0.5, 1.0]
"""Corners in the network's order, of a box that stands on its origin: x ahead, y left, z up."""


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
