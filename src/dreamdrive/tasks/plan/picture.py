"""Plans from above: what stands in the way, and where the car goes among it."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.drive import CELL_M
from dreamdrive.tasks.plan.footprint import CAR
from dreamdrive.tasks.plan.rectangles import corners
from dreamdrive.tasks.plan.trajectory import AHEAD_RAD, Plan

_AHEAD_M, _BEHIND_M, _ASIDE_M, _M_PX = 45.0, 10.0, 20.0, 12
_GROUND, _NOW, _LATER = (30, 32, 36), (235, 235, 240), (90, 90, 110)
PLANNED, MOVED = (255, 90, 90), (90, 220, 120)
_SHIFT = 4  # bits of a pixel's fraction


def draw_plans(
    obstacles_m: Sequence[Float[np.ndarray, "_ 2"]], plans: Sequence[tuple[Plan, tuple[int, int, int]]]
) -> UInt8[np.ndarray, "h w 3"]:
    """Cells that are taken, bright now and darker later, and the car at each waypoint of each plan.

    Args:
        obstacles_m: Middles of cells in the planning frame, the first ones soonest.
        plans: Each with its colour; later ones lie on top.
    """
    size = round((_AHEAD_M + _BEHIND_M) * _M_PX), round(2 * _ASIDE_M * _M_PX)
    image = np.full((*size, 3), _GROUND, np.uint8)
    for step in reversed(range(len(obstacles_m))):
        share = step / max(1, len(obstacles_m) - 1)
        colour = tuple(round(a + share * (b - a)) for a, b in zip(_NOW, _LATER, strict=True))
        for cell in obstacles_m[step]:
            square = cell + CELL_M / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
            cv2.fillConvexPoly(image, _pixels(square), colour, cv2.LINE_AA, _SHIFT)
    own = np.array([[0.0, CAR.ahead_m, CAR.length_m, CAR.width_m, AHEAD_RAD]])
    for plan, colour in plans:
        way = np.vstack([np.zeros((1, 2)), plan.waypoints_m])
        cv2.polylines(image, [_pixels(way)], False, colour, 2, cv2.LINE_AA, _SHIFT)
        for outline in corners(np.concatenate([own, CAR.along(plan.waypoints_m)])):
            cv2.polylines(image, [_pixels(outline)], True, colour, 1, cv2.LINE_AA, _SHIFT)
    return image


def _pixels(points_m: Float[np.ndarray, "n 2"]) -> np.ndarray:
    rows = (_AHEAD_M - points_m[:, 1]) * _M_PX
    columns = (points_m[:, 0] + _ASIDE_M) * _M_PX
    return np.round(np.column_stack([columns, rows]) * 2**_SHIFT).astype(np.int32)
