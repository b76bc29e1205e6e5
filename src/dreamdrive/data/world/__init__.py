"""The procedural street world: layouts drawn at random or given, rendered by rays, with exact truth."""

from dreamdrive.data.world.drive import MOUNTS, Drive, Mount, WorldBox, drive, front_from_mount, make_street
from dreamdrive.data.world.materials import Semantic
from dreamdrive.data.world.render import WorldView
from dreamdrive.data.world.streets import StreetOptions, draw_street
from dreamdrive.data.world.world import World

__all__ = [
    "MOUNTS",
    "Drive",
    "Mount",
    "Semantic",
    "StreetOptions",
    "World",
    "WorldBox",
    "WorldView",
    "draw_street",
    "drive",
    "front_from_mount",
    "make_street",
]
