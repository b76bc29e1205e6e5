"""The procedural street world: layouts drawn at random or given, rendered by rays, with exact truth."""

from dreamdrive.data.world.drive import MOUNTS, Drive, WorldBox, drive, make_street
from dreamdrive.data.world.materials import Semantic
from dreamdrive.data.world.render import WorldView
from dreamdrive.data.world.streets import StreetOptions, draw_street
from dreamdrive.data.world.world import World

__all__ = [
    "MOUNTS",
    "Drive",
    "Semantic",
    "StreetOptions",
    "World",
    "WorldBox",
    "WorldView",
    "draw_street",
    "drive",
    "make_street",
]
