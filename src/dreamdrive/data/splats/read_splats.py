"""Files of Gaussians by their endings, turned to x right, y down, z ahead."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float

from dreamdrive.data.splats.glb import unpack_glb
from dreamdrive.data.splats.ply import unpack_ply
from dreamdrive.data.splats.splats import Splats, turned
from dreamdrive.data.splats.spz import unpack_spz
from dreamdrive.errors import InputError
from dreamdrive.files.paths import read_bytes
from dreamdrive.scene.gaussians import Gaussians

Up = Literal["x", "-x", "y", "-y", "z", "-z"]
"""The axis of a file that points away from the ground."""
MOST_BYTES = 4_000_000_000
_READERS: dict[str, tuple[Callable[[bytes, str], Splats], Up]] = {
    ".ply": (unpack_ply, "-y"),
    ".spz": (unpack_spz, "y"),
    ".glb": (unpack_glb, "y"),
}


def read_splats(path: Path, up: Up | None = None) -> tuple[Gaussians, int, Float[np.ndarray, "3 3"]]:
    """The Gaussians of a PLY, SPZ or GLB file, y down; how many were left out; and how they were turned.

    Those with numbers that cannot be drawn are left out. Without ``up`` it is the axis of the format: y of
    SPZ and GLB, -y of PLY, as 3DGS has it. The rotation leads from the axes of the file to ours.

    Raises:
        InputError: The file cannot be read, is of another form, or none of its Gaussians can be drawn.
    """
    ending = path.suffix.lower()
    if ending not in _READERS:
        raise InputError(f"{path} ends in {ending!r}; expected {', '.join(_READERS)}")
    unpack, usual = _READERS[ending]
    gaussians, dropped = unpack(read_bytes(path, at_most=MOST_BYTES), str(path)).gaussians(str(path))
    rotation = down_from(up or usual)
    return turned(gaussians, rotation), dropped, rotation


def down_from(up: Up) -> Float[np.ndarray, "3 3"]:
    """The rotation that brings an axis to -y, by the least turn: about x where it points along z or y."""
    turns: dict[Up, list[list[int]]] = {
        "-y": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "y": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
        "z": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        "-z": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        "x": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]],
        "-x": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    }
    assert set(turns) == set(get_args(Up))
    return np.array(turns[up], np.float64)
