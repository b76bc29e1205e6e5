"""New drives: manoeuvres, files, and what is free beside a drive."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.drive.aside import CAR_M as CAR_M, Room as Room, room_of as room_of
    from dreamdrive.drive.drives import (
        Drive as Drive,
        along as along,
        distance_m as distance_m,
        drives_of as drives_of,
    )
    from dreamdrive.drive.manoeuvres import (
        MANOEUVRES as MANOEUVRES,
        frame_rate as frame_rate,
        manoeuvre as manoeuvre,
        resampled as resampled,
        smooth as smooth,
    )
    from dreamdrive.drive.occupancy import (
        CAUTIOUS as CAUTIOUS,
        CELL_M as CELL_M,
        OCCUPANCY as OCCUPANCY,
        Obstacles as Obstacles,
        OccupancyOptions as OccupancyOptions,
        obstacles_of as obstacles_of,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
