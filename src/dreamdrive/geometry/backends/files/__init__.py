"""Geometry that the user brings as files: poses, intrinsics and depth, in the common formats.

``attach`` is the door for all of them; ``formats`` tells them apart by their content. Each has a reader in
``readers``, which returns the same noun, ``Given``.
"""

from dreamdrive.geometry.backends.files.attach import attach
from dreamdrive.geometry.backends.files.formats import EXPECTED, bent_model, companions
