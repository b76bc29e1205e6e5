"""Geometry that files of any format, and the user beside them, give for the frames of a clip."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.data.formats.cameras import LensCamera
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json

NAME = "geometry.json"
OPTION = "--geometry-files"
_UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "1/256 m": 1 / 256}
_KEYS = ("metric", "depth_unit", "camera")


@dataclass(frozen=True)
class DepthFiles:
    """Where depth lies.

    The unit is what the stored number 1 means, in metres or, unless ``metric``, in the poses' unit; ``None``
    where that is not declared and the kind of file decides.
    """

    of: Mapping[int, Path] = field(default_factory=dict[int, Path])  # by row of the selected frame
    unit: float | None = None
    metric: bool = True
    kitti: bool = False  # they lie beside KITTI's calibration, in whose PNG the number 1 is 1/256 m


@dataclass(frozen=True)
class SparsePoints:
    """Points of a sparse model in the world of the poses, and which selected frame sees which."""

    points: Float[np.ndarray, "p 3"]
    seen: Bool[np.ndarray, "f p"]


@dataclass(frozen=True)
class FileGeometry:
    """Poses, cameras and depth of the selected frames, as a reader found them."""

    world_from_camera: Float[np.ndarray, "f 4 4"]  # rigid; x right, y down, z forward; any world
    metric: bool  # whether the unit of the poses is the metre
    cameras: Sequence[LensCamera] = ()  # at the size of each picture; none where the format has no intrinsics
    depth: DepthFiles = field(default_factory=DepthFiles)
    sparse: SparsePoints | None = None
    notes: tuple[str, ...] = ()  # what the report should say, a sentence each


@dataclass(frozen=True)
class Declared:
    """What the user declares in ``geometry.json`` of what a format does not say; ``None`` is not declared."""

    metric: bool | None = None  # whether the unit of the poses is the metre
    depth_unit: float | None = None  # metres, or units of the poses, that 1 in a depth file means
    depth_in_poses_unit: bool = False  # whether it is the latter
    camera: str | None = None  # which of several the clip is from


def read_declared(folder: Path) -> Declared:
    """Read ``geometry.json`` of a folder, if it is there."""
    path = folder / NAME
    if not path.is_file():
        return Declared()
    values = read_json(path, OPTION)
    unknown = [key for key in values if key not in _KEYS]
    if unknown:
        raise InputError(f"{path}: {', '.join(unknown)} is not known; expected {', '.join(_KEYS)}")
    metric, camera = values.get("metric"), values.get("camera")
    if not (metric is None or isinstance(metric, bool)):
        raise InputError(f"{path}: metric is {metric!r}; expected true (metres) or false (an unknown unit)")
    if not (camera is None or isinstance(camera, str)):
        raise InputError(f"{path}: camera is {camera!r}; expected its name")
    unit = values.get("depth_unit")
    if unit == "poses":
        return Declared(metric, 1.0, True, camera)
    return Declared(metric, None if unit is None else _unit(unit, path), False, camera)


def _unit(value: Any, path: Path) -> float:
    if isinstance(value, str) and value in _UNITS_M:
        return _UNITS_M[value]
    if isinstance(value, (int, float)) and not isinstance(value, bool) and 0 < value < 1e6:
        return float(value)
    known = ", ".join(f'"{name}"' for name in _UNITS_M)
    raise InputError(
        f'{path}: depth_unit is {value!r}; expected {known}, "poses" (their unit) or metres as a number'
    )
