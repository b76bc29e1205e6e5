"""Our own format: ``cameras.json`` and a folder ``depth``.

A folder holds

- ``cameras.json``: ``{"width", "height", "intrinsics": {"fx", "fy", "cx", "cy"},
  "world_from_camera": [4x4, ...], "frames": [index, ...]}``. Pixels are counted by integer index (the first
  pixel's centre is 0), axes are x right, y down, z forward, lengths are metres. ``frames`` names the source
  frame of each pose and may be left out when there is one for each source frame, in order.
- ``depth/NNNN.npz`` (array ``depth_m``, metres) or ``depth/NNNN.png`` (16 bit, millimetres), or .npy, .exr,
  NNNN the source frame. Frames without a file have no depth; the folder may be missing.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from dreamdrive.data.camera_models import IndexedPinhole, LensCamera, NamedFrames
from dreamdrive.data.pose_files import clean_poses
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type
from dreamdrive.geometry.backends.files.declared import read_declared
from dreamdrive.geometry.backends.files.depth import find_depth
from dreamdrive.geometry.backends.files.given import Given
from dreamdrive.geometry.backends.files.json_record import read_record
from dreamdrive.geometry.backends.files.wanted import Wanted
from dreamdrive.scene.camera import Camera

_NEEDED = ("width", "height", "intrinsics", "world_from_camera")


def read_plain(path: Path, wanted: Wanted) -> Given:
    """Read ``cameras.json`` and the depth beside it.

    Raises:
        InputError: The file is malformed or has no pose for a selected frame.
    """
    record = read_record(path)
    if any(key not in record for key in _NEEDED):
        raise InputError(f"{path}: expected an object with {', '.join(_NEEDED)}")
    declared = read_declared(path.parent)
    return Given(
        _poses(record, wanted, path),
        metric=declared.metric is not False,
        cameras=(LensCamera(_camera(record, path), None),),
        camera=np.zeros(len(wanted.index), np.intp),
        depth=find_depth(path.parent / "depth", [f"{int(i):04d}" for i in wanted.index], declared),
    )


def _camera(record: dict[str, Any], path: Path) -> Camera:
    try:
        return of_type(record, IndexedPinhole, str(path)).camera()
    except ValueError as error:
        raise InputError(f"{path}: width, height and intrinsics fx, fy, cx, cy expected ({error})") from error


def _poses(record: dict[str, Any], wanted: Wanted, path: Path) -> Float[np.ndarray, "f 4 4"]:
    try:
        matrices = np.asarray(record["world_from_camera"], np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{path}: world_from_camera is no list of 4x4 matrices ({error})") from error
    frames = list(range(len(matrices))) if matrices.ndim else []
    named = of_type(record, NamedFrames, str(path)).frames
    frames = frames if named is None else named
    if matrices.ndim != 3 or len(frames) != len(matrices):
        raise InputError(f"{path}: {len(frames)} frames for world_from_camera of shape {matrices.shape}")
    poses = clean_poses(matrices, f"{path}: world_from_camera", lambda row: f"pose {row} (counted from 0)")
    row = {frame: k for k, frame in enumerate(frames)}
    missing = [int(i) for i in wanted.index if int(i) not in row]
    if missing:
        raise InputError(f"{path}: has no pose for the selected frames {missing[:5]}")
    return poses[[row[int(i)] for i in wanted.index]]
