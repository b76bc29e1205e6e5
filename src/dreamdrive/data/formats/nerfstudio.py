"""``transforms.json`` of nerfstudio and instant-ngp.

``transform_matrix`` is world_from_camera with OpenGL's axes (x right, y up, z backwards): y and z of the
camera are turned round, the world stays. Principal points count from the corner of the picture (the first
pixel's centre is 0.5), as ours do. The unit is arbitrary. A number in a depth file times
``depth_unit_scale_factor`` (0.001 where it is not there) is a length in the unit of the poses.
"""

from collections.abc import Mapping, Sequence
from math import tan
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float

from dreamdrive.data.formats.cameras import LensCamera, lens_camera
from dreamdrive.data.formats.rigid import clean_poses
from dreamdrive.errors import InputError
from dreamdrive.files.paths import is_path

USUAL_FACTOR = 1e-3
"""``depth_unit_scale_factor`` where a file has none."""
_MODELS = ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE")
_OURS_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


def transforms_frames(values: Mapping[str, Any], where: str) -> list[dict[str, Any]]:
    """The frames of a ``transforms.json``, each with what is shared by all of them."""
    frames = values.get("frames")
    listed = cast("list[Any]", frames) if isinstance(frames, list) else []
    if not listed or not all(isinstance(frame, dict) for frame in listed):
        raise InputError(f"{where}: expected frames, a list of objects with file_path and transform_matrix")
    shared = {key: value for key, value in values.items() if key != "frames"}
    return [{**shared, **frame} for frame in listed]


def frame_camera(values: Mapping[str, Any], where: str) -> LensCamera:
    """The camera that a ``transforms.json``, or one frame of it, describes.

    Without ``fl_y`` the pixels are square, without ``cx``, ``cy`` the principal point is in the middle, and
    ``camera_angle_x`` stands in for ``fl_x``, as in the files of instant-ngp.
    """

    def number(key: str, default: float | None = None) -> float:
        value = values.get(key, default)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e12:
            raise InputError(f"{where}: expected a number for {key}, got {value!r}")
        return float(value)

    name = str(values.get("camera_model", "OPENCV"))
    if name not in _MODELS:
        raise InputError(
            f"{where}: camera_model {name!r} is not known; expected {', '.join(_MODELS)}: undistort the "
            "pictures and give a transforms.json of them"
        )
    width, height = number("w"), number("h")
    if not (width >= 1 and height >= 1 and width == int(width) and height == int(height)):
        raise InputError(f"{where}: expected w and h as whole pixels, got {width:g}x{height:g}")
    if "fl_x" not in values and "camera_angle_x" in values:
        angle = number("camera_angle_x")
        if not 0 < angle < 3.1:
            raise InputError(f"{where}: camera_angle_x {angle:g}: expected radians between 0 and 3.1")
        fx = width / 2 / tan(angle / 2)
    else:
        fx = number("fl_x")
    found = {
        "fx": fx,
        "fy": number("fl_y", fx),
        "cx": number("cx", width / 2),
        "cy": number("cy", height / 2),
        **{key: number(key, 0.0) for key in ("k1", "k2", "k3", "k4", "p1", "p2")},
    }
    fisheye = name == "OPENCV_FISHEYE"
    if found["k4"] and not fisheye:
        raise InputError(f"{where}: k4 {found['k4']:g} belongs to OPENCV_FISHEYE; {name} has k1 k2 p1 p2 k3")
    if fisheye:
        del found["p1"], found["p2"]
    return lens_camera(found, (int(width), int(height)), fisheye, where)


def frame_names(frames: Sequence[Mapping[str, Any]], where: str) -> list[str]:
    """The file name of each frame's picture."""
    names = [frame.get("file_path") for frame in frames]
    for row, name in enumerate(names):
        if not isinstance(name, str) or not name:
            raise InputError(f"{where}: frame {row} (counted from 0) has no file_path")
    return cast("list[str]", names)


def frame_poses(frames: Sequence[Mapping[str, Any]], where: str) -> Float[np.ndarray, "f 4 4"]:
    """Poses world_from_camera (F, 4, 4) of named frames, with our axes."""
    matrices: list[np.ndarray] = []
    for frame in frames:
        try:
            matrix = np.array(frame.get("transform_matrix"), np.float64)
        except (TypeError, ValueError):
            matrix = np.zeros(0)
        if matrix.shape == (3, 4):
            matrix = np.vstack([matrix, (0, 0, 0, 1)])
        if matrix.shape != (4, 4):
            raise InputError(f"{where}: {frame['file_path']}: transform_matrix is no 4x4 matrix of numbers")
        matrices.append(matrix)
    poses = clean_poses(
        np.array(matrices), where, lambda row: f"transform_matrix of {frames[row]['file_path']}"
    )
    return poses @ _OURS_FROM_OPENGL


def depth_file(path: Path, frame: Mapping[str, Any]) -> Path | None:
    """The depth file that a frame of the file ``path`` names, whether it is there or not."""
    name = frame.get("depth_file_path")
    if name is None:
        return None
    if not is_path(name):
        raise InputError(f"{path}: depth_file_path {name!r} is no name of a file")
    return path.parent / str(name)
