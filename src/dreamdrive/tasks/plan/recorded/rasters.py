"""Rasters of the published metrics: which road users are drawn, in which frame."""

import numpy as np
from jaxtyping import Bool, UInt8

from dreamdrive.scene.street.log import word_of
from dreamdrive.tasks.plan.agents import Agents
from dreamdrive.tasks.plan.grid import GRID, PlanningGrid
from dreamdrive.tasks.plan.rectangles import corners
from dreamdrive.tasks.plan.trajectory import LIDAR_AHEAD_M, ego_from_planning

INVALID = 255
"""In all cells of a step for which UniAD has no labels. The recorded drive collides there: it is excused."""
_DETECTED = {
    f"vehicle.{kind}": kind
    for kind in ("car", "truck", "bus", "trailer", "construction", "motorcycle", "bicycle")
}
"""The vehicles among the ten classes of nuScenes' detection; those of emergency are none of them."""
_ROAD_USERS = {"vehicle": "vehicle", "human": "human"}


def uniad_rasters(
    agents: Agents, labelled: Bool[np.ndarray, " t"], grid: PlanningGrid = GRID
) -> UInt8[np.ndarray, "t c c"]:
    """UniAD's cells: vehicles but those of emergency, in the planning frame; columns count to the right.

    Args:
        agents: All road users.
        labelled: Which steps have labels; the others are ``INVALID``.
        grid: The cells.
    """
    drawn = np.array([word_of(each, _DETECTED) is not None for each in agents.categories], bool)
    made = [
        grid.draw(corners(boxes[there & drawn]))
        for boxes, there in zip(agents.boxes, agents.there, strict=True)
    ]
    return np.where(labelled[:, None, None], np.stack(made), np.uint8(INVALID))


def stp3_rasters(
    agents: Agents, grid: PlanningGrid = GRID, origin_ahead_m: float = LIDAR_AHEAD_M
) -> UInt8[np.ndarray, "t c c"]:
    """ST-P3's cells: vehicles and people seen up to now, in the ego frame; columns count to the left.

    Args:
        agents: All road users, in the planning frame.
        grid: The cells.
        origin_ahead_m: How far the origin of the planning frame is ahead of that of the ego frame.
    """
    drawn = (
        np.array([word_of(each, _ROAD_USERS) is not None for each in agents.categories], bool) & agents.seen
    )
    made = [
        # Columns are y of the ego frame, rows are x.
        grid.draw(ego_from_planning(corners(boxes[there & drawn]), origin_ahead_m)[..., ::-1])
        for boxes, there in zip(agents.boxes, agents.there, strict=True)
    ]
    return np.stack(made)
