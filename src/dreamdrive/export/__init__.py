"""Scenes in other formats."""

from dreamdrive.export.kinds import KINDS, export
from dreamdrive.export.ply import left_out_of_ply, write_ply
