"""``transforms.json`` of nerfstudio and instant-ngp.

``transform_matrix`` is world_from_camera with OpenGL's axes (x right, y up, z backwards): y and z of the
camera are turned round, the world stays. Principal points count from the corner of the picture (the first
pixel's centre is 0.5), as ours do. The unit is arbitrary. A number in a depth file times
``depth_unit_scale_factor`` (0.001 where it is not there) is a length in the unit of the poses.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from dreamdrive.data.camera_models import from_nerfstudio, transforms_frames
from dreamdrive.data.pose_files import clean_poses
from dreamdrive.errors import InputError
from dreamdrive.files.paths import is_path
from dreamdrive.geometry.backends.files.cameras import different
from dreamdrive.geometry.backends.files.declared import Declared, read_declared
from dreamdrive.geometry.backends.files.depth import ENDINGS
from dreamdrive.geometry.backends.files.given import DepthFiles, Given
from dreamdrive.geometry.backends.files.json_record import read_record
from dreamdrive.geometry.backends.files.wanted import Wanted

_OURS_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
_USUAL_FACTOR = 1e-3


def read_transforms(path: Path, wanted: Wanted) -> Given:
    """Read a ``transforms.json`` and the depth that it names.

    Raises:
        InputError: The file is malformed, lacks a frame or names depth that is not there.
    """
    record = read_record(path)
    frames = transforms_frames(record, str(path))
    names = [frame.get("file_path") for frame in frames]
    for row, name in enumerate(names):
        if not isinstance(name, str) or not name:
            raise InputError(f"{path}: frame {row} (counted from 0) has no file_path")
    rows, notes = wanted.rows([str(name) for name in names], str(path))
    chosen = [frames[row] for row in rows]
    where = [f"{path}: {frame['file_path']}" for frame in chosen]
    cameras, camera = different([from_nerfstudio(*each) for each in zip(chosen, where, strict=True)])
    declared = read_declared(path.parent)
    depth, said = _depth(record, chosen, declared, path)
    return Given(
        _poses(chosen, path),
        metric=declared.metric is True,
        cameras=cameras,
        camera=camera,
        depth=depth,
        notes=notes + said,
    )


def depth_files(path: Path) -> list[Path]:
    """All depth files that a ``transforms.json`` names, whether they are there or not."""
    frames = transforms_frames(read_record(path), str(path))
    return [_beside(path, frame["depth_file_path"]) for frame in frames if frame.get("depth_file_path")]


def _beside(path: Path, name: object) -> Path:
    """The file that a name means, which counts from the folder of ``path``."""
    if not is_path(name):
        raise InputError(f"{path}: depth_file_path {name!r} is no name of a file")
    return path.parent / str(name)


def _poses(frames: list[dict[str, Any]], path: Path) -> Float[np.ndarray, "f 4 4"]:
    matrices: list[np.ndarray] = []
    for frame in frames:
        try:
            matrix = np.array(frame.get("transform_matrix"), np.float64)
        except (TypeError, ValueError):
            matrix = np.zeros(0)
        if matrix.shape == (3, 4):
            matrix = np.vstack([matrix, (0, 0, 0, 1)])
        if matrix.shape != (4, 4):
            raise InputError(f"{path}: {frame['file_path']}: transform_matrix is no 4x4 matrix of numbers")
        matrices.append(matrix)
    name = [str(frame["file_path"]) for frame in frames]
    poses = clean_poses(np.array(matrices), str(path), lambda row: f"transform_matrix of {name[row]}")
    return poses @ _OURS_FROM_OPENGL


def _depth(
    record: Mapping[str, Any], frames: list[dict[str, Any]], declared: Declared, path: Path
) -> tuple[DepthFiles, tuple[str, ...]]:
    of: dict[int, Path] = {}
    for row, frame in enumerate(frames):
        name = frame.get("depth_file_path")
        if name is None:
            continue
        file = _beside(path, name)
        if not file.is_file() or file.suffix.lower() not in ENDINGS:
            raise InputError(
                f"{path}: depth_file_path {name} of {frame['file_path']} is no file that can be read "
                f"({', '.join(ENDINGS)})"
            )
        of[row] = file
    if declared.depth_unit is not None:
        return DepthFiles(of, declared.depth_unit, not declared.depth_in_poses_unit), ()
    factor = record.get("depth_unit_scale_factor", _USUAL_FACTOR)
    if isinstance(factor, bool) or not isinstance(factor, (int, float)) or not 0 < factor < 1e6:
        raise InputError(f"{path}: depth_unit_scale_factor is {factor!r}; expected a positive number")
    said = ()
    if of and "depth_unit_scale_factor" not in record:
        said = (f"{path.name} has no depth_unit_scale_factor: stored depth times {_USUAL_FACTOR} is taken.",)
    return DepthFiles(of, float(factor), metric=False), said
