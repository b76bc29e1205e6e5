"""The drivable area, as far as a map tells it."""

from dataclasses import dataclass

import numpy as np
import shapely
from jaxtyping import Float
from shapely.geometry.base import BaseGeometry

from dreamdrive.errors import InputError
from dreamdrive.scene.level import level_from_world
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.street.layout import Layout, track_function
from dreamdrive.scene.street.log import Log
from dreamdrive.tasks.plan import corners

_DRIVABLE = {"road", "crossing", "parking"}
"""Areas of a layout."""
_LAYERS = ("drivable_area", "road_segment", "lane")
"""Of a log's map; the first that there is."""


@dataclass(frozen=True)
class DrivableArea:
    """The drivable area in the level frame of a scene; metres."""

    area: BaseGeometry

    def sticks_out_m(self, rectangle: Float[np.ndarray, "5"]) -> float:
        """How far the farthest corner of a car is outside; 0 where it is inside altogether."""
        points = shapely.points(corners(rectangle))
        return float(shapely.distance(self.area, points).max())


def road_of_layout(layout: Layout, start_s: float = 0.0) -> DrivableArea:
    """The road of a layout that a scene was made of; hills are left out of account.

    Args:
        layout: The street.
        start_s: Its time at the scene's first frame.
    """
    x, y, yaw = track_function(layout.ego.track)(np.array([start_s]))[0]
    area: BaseGeometry = shapely.Polygon()
    for each in layout.areas:
        polygon = shapely.make_valid(shapely.Polygon(each.polygon, each.holes))
        area = area.union(polygon) if each.kind in _DRIVABLE else area.difference(polygon)
    turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    return _road(area, turn, -turn @ [x, y], "the layout")


def road_of_log(log: Log, scene: Scene) -> DrivableArea:
    """The road of the map of a drive that a scene was made of.

    Raises:
        InputError: The scene was made of something else, or the drive has no map.
    """
    link = scene.provenance.log
    if link is None or link.name != log.name:
        of = "no drive of a data set" if link is None else link.name
        raise InputError(f"the scene was made of {of}, the map is that of {log.name}; give that of its drive")
    layer = next((log.map.areas[name] for name in _LAYERS if log.map.areas.get(name)), ())
    polygons = [shapely.make_valid(shapely.Polygon(each.outline, each.holes)) for each in layer]
    level_from_log = level_from_world(scene) @ np.linalg.inv(np.array(link.log_from_world))
    ground = np.linalg.inv(level_from_log) @ [0, 0, 0, 1]
    shift = level_from_log[:2, 3] + level_from_log[:2, 2] * ground[2]
    return _road(shapely.union_all(polygons), level_from_log[:2, :2], shift, log.name)


def _road(
    area: BaseGeometry, turn: Float[np.ndarray, "2 2"], shift_m: Float[np.ndarray, "2"], of: str
) -> DrivableArea:
    if area.is_empty:
        raise InputError(
            f"{of} has no road on its map; leave it out, and the recorded path tells what is off"
        )
    moved = shapely.transform(area, lambda points: points @ turn.T + shift_m)
    shapely.prepare(moved)
    return DrivableArea(moved)
