"""Geometry that the user brings as files: poses, intrinsics and depth, in the common formats."""

from dreamdrive.geometry.backends.files.attach import attach
from dreamdrive.geometry.backends.files.formats import EXPECTED, bent_model, companions
