"""The surroundings of the own car seen from above."""

import cv2
import numpy as np
import shapely
from jaxtyping import Float, UInt8

from dreamdrive.drive import CELL_M
from dreamdrive.tasks.environment.bicycle import EgoOptions, EgoState
from dreamdrive.tasks.environment.course import Course
from dreamdrive.tasks.environment.road_users import RoadUserStates
from dreamdrive.tasks.plan import corners

SIDE_PX = 320
_PX_PER_M = 6.0
_EGO_AT = (0.5, 0.8)
"""Where the car is in the picture, as shares of its width and height; up is ahead."""
_GROUND, _ROAD, _PATH = (30, 32, 36), (58, 60, 66), (236, 236, 240)
_STANDING, _ROAD_USER, _EGO = (255, 160, 40), (70, 150, 255), (210, 30, 60)


def draw_above(
    course: Course, state: EgoState, road_users: RoadUserStates, ego: EgoOptions
) -> UInt8[np.ndarray, "s s 3"]:
    """Road, recorded path, cells in which something stands, road users, and the own car."""
    image = np.full((SIDE_PX, SIDE_PX, 3), _GROUND, np.uint8)
    if course.road is not None:
        _draw_road(image, course, state)
    path = _pixels(state, course.path.places_m)
    cv2.polylines(image, [path], False, _PATH, 1, cv2.LINE_AA)
    cells = np.column_stack(
        [course.standing_m, np.full((len(course.standing_m), 2), CELL_M), np.zeros(len(course.standing_m))]
    )
    for rectangles, colour in (
        (cells, _STANDING),
        (road_users.boxes[road_users.there], _ROAD_USER),
        (state.rectangle(ego)[None], _EGO),
    ):
        for polygon in _pixels(state, corners(rectangles)):
            cv2.fillConvexPoly(image, polygon, colour, cv2.LINE_AA)
    return image


def _draw_road(image: UInt8[np.ndarray, "s s 3"], course: Course, state: EgoState) -> None:
    assert course.road is not None
    reach_m = SIDE_PX / _PX_PER_M
    window = shapely.box(state.x_m - reach_m, state.y_m - reach_m, state.x_m + reach_m, state.y_m + reach_m)
    for part in shapely.get_parts(shapely.intersection(course.road.area, window)):
        if isinstance(part, shapely.Polygon):
            rings = [part.exterior, *part.interiors]
            cv2.fillPoly(image, [_pixels(state, np.array(ring.coords)) for ring in rings], _ROAD)


def _pixels(state: EgoState, places_m: Float[np.ndarray, "*n 2"]) -> np.ndarray:
    """Columns and rows (..., 2) of places in the level frame."""
    away = np.clip(places_m - [state.x_m, state.y_m], -1e3, 1e3)
    cos, sin = np.cos(state.yaw_rad), np.sin(state.yaw_rad)
    ahead = away[..., 0] * cos + away[..., 1] * sin
    left = away[..., 1] * cos - away[..., 0] * sin
    middle = SIDE_PX * np.array(_EGO_AT)
    return np.rint(middle - _PX_PER_M * np.stack([left, ahead], axis=-1)).astype(np.int32)
