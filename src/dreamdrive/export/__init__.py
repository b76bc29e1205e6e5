"""Scenes in other formats."""

from dreamdrive.export.kinds import KINDS, export
from dreamdrive.export.ply import read_ply, write_ply

__all__ = ["KINDS", "export", "read_ply", "write_ply"]
