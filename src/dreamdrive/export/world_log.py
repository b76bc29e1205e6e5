"""A drawn street as a drive with labels, as its cameras saw it."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from dreamdrive.export.log import AXLE_M, Moved, RigCamera, Taken
from dreamdrive.scene.street.layout import Layout
from dreamdrive.scene.street.log import LogMap, Polygon
from dreamdrive.scene.street.truth import DriveTruth, Mount

CATEGORIES: Mapping[str, str] = {
    "car": "vehicle.car",
    "van": "vehicle.car",
    "truck": "vehicle.truck",
    "bus": "vehicle.bus.rigid",
    "motorcycle": "vehicle.motorcycle",
    "bicycle": "vehicle.bicycle",
    "pedestrian": "human.pedestrian.adult",
}
"""nuScenes counts vans as cars."""
LAYERS = {
    "road": ("drivable_area", "road_segment"),
    "parking": ("drivable_area", "carpark_area"),
    "sidewalk": ("walkway",),
    "crossing": ("ped_crossing",),
}
"""Layers of the map expansion that an area of a layout belongs to."""
_CLEAR_M = 150.0
"""Pictures of maps begin at 0: the least place of a drive lies so far from it."""


def taken_of_world(drives: Mapping[Mount, DriveTruth], name: str) -> Taken:
    """A drawn street as a drive to be written; its world is the street's map, moved away from 0."""
    first = next(iter(drives.values()))
    layout = first.layout
    front = _map_poses(first)
    moved = np.eye(4)
    moved[:2, 3] = _CLEAR_M - np.floor(front[:, :2, 3].min(axis=0))
    # Up, ahead and left of the car at its first frame tell how the cameras are mounted.
    ego_from_front = _level(front[0], layout)
    world_from_ego = moved @ front @ np.linalg.inv(ego_from_front)
    rig = tuple(
        RigCamera(
            f"CAM_{mount.upper()}",
            drive.cameras[0],
            np.linalg.inv(world_from_ego[0]) @ moved @ _map_poses(drive)[0],
        )
        for mount, drive in drives.items()
    )
    seen = list(drives.values())
    map_from_world = np.linalg.inv(first.world_from_map)
    return Taken(
        name=name,
        about=f"Drawn street of edition {layout.edition}, seed {layout.seed}",
        location=f"drawn-street-{name}",
        times_s=first.times_s,
        world_from_ego=world_from_ego,
        cameras=rig,
        look=lambda camera, step: (seen[camera].frames[step], seen[camera].depth_m[step]),
        boxes=tuple(
            Moved(
                box.id,
                CATEGORIES[box.kind],
                box.size_m,
                moved @ map_from_world @ box.world_from_box,
                np.ones(len(first.times_s), bool),
            )
            for box in first.boxes
        ),
        map=map_of_layout(layout, moved[:2, 3]),
    )


def map_of_layout(layout: Layout, offset_m: Float[np.ndarray, " 2"]) -> LogMap:
    """The map of a layout by layers, moved by an offset."""
    areas: dict[str, list[Polygon]] = {}
    for area in layout.areas:
        holes = tuple(np.array(hole) + offset_m for hole in area.holes)
        polygon = Polygon(np.array(area.polygon) + offset_m, holes)
        for layer in LAYERS.get(area.kind, ()):
            areas.setdefault(layer, []).append(polygon)
    lines: dict[str, list[Float[np.ndarray, "_ 2"]]] = {}
    for line in layout.lines:
        if line.kind in ("lane_divider", "road_divider"):
            lines.setdefault(line.kind, []).append(np.array(line.points) + offset_m)
    return LogMap(
        {name: tuple(each) for name, each in areas.items()},
        {name: tuple(each) for name, each in lines.items()},
    )


def _map_poses(drive: DriveTruth) -> Float[np.ndarray, "f 4 4"]:
    """Poses of a camera in the frame of the street's map."""
    return np.linalg.inv(drive.world_from_map) @ drive.trajectory.world_from_camera


def _level(map_from_front: Float[np.ndarray, "4 4"], layout: Layout) -> Float[np.ndarray, "4 4"]:
    """Mounting of the front camera on a car that stands level, looks where it does and is as high."""
    ahead = map_from_front[:3, 2] * (1, 1, 0)
    ahead = ahead / np.linalg.norm(ahead)
    map_from_ego = np.eye(4)
    map_from_ego[:3, 0], map_from_ego[:3, 1] = ahead, np.cross([0, 0, 1], ahead)
    map_from_ego[:3, 3] = map_from_front[:3, 3] - AXLE_M * ahead - (0, 0, layout.ego.camera_height_m)
    return np.linalg.inv(map_from_ego) @ map_from_front
