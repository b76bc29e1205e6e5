"""The procedural street world: layouts drawn at random or given, rendered by rays, with exact truth."""

from dreamdrive.world.drive import MOUNTS, Drive, Mount, WorldBox, drive, front_from_mount, make_street
from dreamdrive.world.materials import Semantic
from dreamdrive.world.render import WorldView
from dreamdrive.world.streets import StreetOptions, draw_street
from dreamdrive.world.world import World

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
