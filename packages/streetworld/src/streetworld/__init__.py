"""The procedural street world: layouts drawn at random or given, rendered by rays, with exact truth."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from streetworld.drive import (
        DrawnDrive as DrawnDrive,
        drive as drive,
        ego_poses as ego_poses,
        front_from_mount as front_from_mount,
        make_street as make_street,
        pictures as pictures,
        pinhole_of as pinhole_of,
    )
    from streetworld.edition1.traffic import to_track as to_track
    from streetworld.editions import draw_street as draw_street
    from streetworld.engine.road import LANE_M as LANE_M, PARKING_M as PARKING_M, Road as Road
    from streetworld.engine.street import Moment as Moment, Mover as Mover
    from streetworld.engine.view import WorldView as WorldView
    from streetworld.files import write_world as write_world
    from streetworld.options import StreetKind as StreetKind, StreetOptions as StreetOptions
    from streetworld.picture import picture_of as picture_of
    from streetworld.world import World as World

__version__ = "2.0"
__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
