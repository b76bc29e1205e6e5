"""``geometry.json``: what a format does not say about its units."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dreamdrive.errors import InputError
from dreamdrive.files.json_file import read_json

NAME = "geometry.json"
OPTION = "--geometry-files"
_UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "1/256 m": 1 / 256}
_KEYS = ("metric", "depth_unit", "camera")


@dataclass(frozen=True)
class Declared:
    """What the user declares beside the files; ``None`` is not declared.

    Attributes:
        metric: Whether the unit of the poses is the metre.
        depth_unit: What the number 1 in a depth file means, in metres, or in the poses' unit.
        depth_in_poses_unit: Whether it is the latter.
        camera: Which of several cameras the clip is from.
    """

    metric: bool | None = None
    depth_unit: float | None = None
    depth_in_poses_unit: bool = False
    camera: str | None = None


def read_declared(folder: Path) -> Declared:
    """Read ``geometry.json`` of a folder, if it is there.

    Raises:
        InputError: It holds anything but ``metric``, ``depth_unit`` and ``camera``, or wrong values.
    """
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
