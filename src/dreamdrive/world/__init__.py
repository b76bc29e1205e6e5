"""The procedural street world: layouts drawn at random or given, rendered by rays, with exact truth."""

from dreamdrive.world.drive import (
    MOUNTS,
    Drive,
    Mount,
    WorldBox,
    drive,
    front_from_mount,
    make_street,
    pictures,
)
from dreamdrive.world.files import KIND, is_world, read_drives, read_world, write_world
from dreamdrive.world.layout_picture import draw_layout
from dreamdrive.world.materials import Semantic
from dreamdrive.world.mesh import upright
from dreamdrive.world.options import StreetKind, StreetOptions
from dreamdrive.world.render import WorldView, picture_of
from dreamdrive.world.streets import draw_street
from dreamdrive.world.world import Moment, Mover, World
