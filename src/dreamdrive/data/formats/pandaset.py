"""PandaSet: ``cameras.json`` of all cameras, and the boxes of ``cuboids.json``.

``{"cameras": {name: {"width", "height", "K": 3x3, "camera_to_world": [4x4, ...], "frames": [index, ...]}}}``:
axes x right, y down, z forward, metres, ``frames`` the poses that have a picture. ``K`` is a calibration in
OpenCV's way, the first pixel's centre at 0: 0.5 is added to its principal point.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, cast

import msgspec
import numpy as np
from msgspec import Meta

from dreamdrive.data.formats.rigid import PoseRows, clean_poses, numbers, pose_name
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, read_json
from dreamdrive.scene.camera import FARTHEST_M, Camera

Place = Annotated[float, Meta(ge=-FARTHEST_M, le=FARTHEST_M)]
_Row = tuple[float, float, float]


class _Calibration(msgspec.Struct):
    width: int
    height: int
    K: tuple[_Row, _Row, _Row]


@dataclass(frozen=True)
class PandasetCamera:
    """One camera of ``cameras.json``: poses of its pictures, their indices among the sweeps, its entry."""

    rows: PoseRows
    sweeps: list[int]
    entry: Mapping[str, Any]

    def pinhole(self) -> Camera:
        """Its pinhole."""
        try:
            known = of_type(self.entry, _Calibration, "calibration")
            (fx, _, cx), (_, fy, cy), _ = known.K
            return Camera(fx, fy, cx + 0.5, cy + 0.5, known.width, known.height)
        except ValueError as error:
            raise InputError(
                f"{self.rows.where} has no usable width, height and K ({error}); expected pixels and a 3x3 "
                "matrix"
            ) from error


def pandaset_camera(values: Mapping[str, Any], where: str, name: str | None) -> PandasetCamera:
    """A camera of what ``cameras.json`` holds."""
    listed = values.get("cameras")
    cameras = cast("dict[str, Any]", listed if isinstance(listed, dict) else {})
    if name not in cameras:
        raise InputError(
            f"{where} has the cameras {', '.join(cameras)}; none is called like the input, {name!r}: "
            "name the input folder like its camera"
        )
    entry = cast("dict[str, Any]", cameras[name] if isinstance(cameras[name], dict) else {})
    where = f"{where}: {name}"
    poses = clean_poses(numbers(entry.get("camera_to_world", []), where), where, pose_name)
    frames = numbers(entry.get("frames", list(range(len(poses)))), where)
    if frames.ndim != 1 or not len(frames) or not np.isin(frames, np.arange(len(poses))).all():
        raise InputError(f"{where}: frames: expected a list of indices of its {len(poses)} poses")
    sweeps = frames.astype(int)
    return PandasetCamera(PoseRows(where, poses[sweeps]), sweeps.tolist(), entry)


class Cuboid(msgspec.Struct):
    """A box of one sweep in metres, z up: its middle in the world, and its yaw about the vertical in radians.

    ``motion`` is PandaSet's label, such as ``Moving``; ``stationary`` is told where there is no label of
    motion.
    """

    position: tuple[Place, Place, Place]
    size_wlh: tuple[Place, Place, Place]
    yaw: Place
    motion: str | None = None
    stationary: bool | None = None

    @property
    def moves(self) -> bool:
        """Whether it is labelled as moving, or without a label of motion is not stationary."""
        return self.motion == "Moving" or (self.motion is None and self.stationary is False)


class _Cuboids(msgspec.Struct):
    frames: list[list[Cuboid]]


def moving_cuboids(path: Path, option: str, sweeps: list[int]) -> list[list[Cuboid]]:
    """Boxes of what moves in each of some sweeps, from ``cuboids.json``."""
    try:
        frames = of_type(read_json(path, option), _Cuboids, "cuboids").frames
        return [[box for box in frames[sweep] if box.moves] for sweep in sweeps]
    except (InputError, IndexError) as error:
        raise InputError(
            f"{option} {path} is damaged ({error}); expected frames, each a list of boxes with motion, "
            "position, size_wlh and yaw: take it away to do without what moves"
        ) from error
