"""The geometry that a recording's folder tells: poses, calibration, lidar points, boxes of what moves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from jaxtyping import Bool, Float
from msgspec import Meta

from dreamdrive.data.array_file import read_npz
from dreamdrive.data.cameras.poses import read_pose_file
from dreamdrive.data.formats.cameras import IndexedPinhole, Intrinsics
from dreamdrive.data.formats.pandaset import Cuboid, moving_cuboids, pandaset_camera
from dreamdrive.data.pictures.picture_file import read_picture
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, read_json
from dreamdrive.scene.camera import FARTHEST_M, MAX_SIDE_PX, Camera

_PNG_PER_M = 256.0
"""Grey levels a metre in KITTI's 16-bit depth pictures."""


class _About(msgspec.Struct):
    width: Annotated[int, Meta(ge=1, le=MAX_SIDE_PX)]
    height: Annotated[int, Meta(ge=1, le=MAX_SIDE_PX)]
    intrinsics: Intrinsics | None = None


@dataclass(frozen=True)
class DepthPoints:
    """Points of one frame with known depth along z, and whether they lie in the box of something that moves.

    Places are column and row at the recording's size; the centre of the first pixel is (0.5, 0.5).
    """

    place_px: Float[np.ndarray, "n 2"]
    depth_m: Float[np.ndarray, " n"]
    moving: Bool[np.ndarray, " n"]


@dataclass(frozen=True)
class RecordedTruth:
    """What a recording's folder says about the geometry of its frames.

    Files with points are by the frame's index. Without a calibration the pinhole is None, as the boxes of
    what moves in each frame are where nothing says what moves.
    """

    world_from_camera: Float[np.ndarray, "n 4 4"]
    size: tuple[int, int]
    pinhole: Camera | None
    depth_files: Mapping[int, Path]
    boxes: Sequence[Sequence[Cuboid]] | None

    def points(self, frame: int) -> DepthPoints:
        """The points of a frame, from its file."""
        path = self.depth_files[frame]
        u, v, depth_m = _picture(path, self.size) if path.suffix == ".png" else _table(path)
        place_px = np.column_stack([u, v]) + 0.5
        moving = np.zeros(len(depth_m), dtype=bool)
        if self.boxes is not None and self.pinhole is not None:
            camera = self.pinhole.at(self.world_from_camera[frame])
            points = camera.lift(np.column_stack([place_px, depth_m]))
            for box in self.boxes[frame]:
                moving |= _inside(points, box)
        return DepthPoints(place_px, depth_m, moving)


def read_cameras_json(folder: Path, camera: str | None) -> RecordedTruth:
    """A folder like PandaSet's: ``cameras.json``, and ``lidar_depth_NAME`` and ``cuboids.json`` where given.

    The camera is ``NAME_camera``, as the scene's input is called.
    """
    file = folder / "cameras.json"
    found = pandaset_camera(read_json(file, "--truth"), f"--truth {file}", camera)
    pinhole = found.pinhole()
    place = {sweep: frame for frame, sweep in enumerate(found.sweeps)}
    lidar = _numbered(folder / f"lidar_depth_{str(camera).removesuffix('_camera')}")
    files = {place[sweep]: path for sweep, path in lidar.items() if sweep in place}
    boxes = folder / "cuboids.json"
    moving = moving_cuboids(boxes, "--truth", found.sweeps) if boxes.is_file() else None
    size = pinhole.width_px, pinhole.height_px
    return RecordedTruth(found.rows.world_from_camera, size, pinhole, files, moving)


def read_poses_txt(folder: Path) -> RecordedTruth:
    """A folder with ``poses.txt`` (KITTI or TUM), ``meta.json`` and, where there is one, ``lidar_depth``."""
    poses = read_pose_file(folder / "poses.txt", "--truth").world_from_camera
    file = folder / "meta.json"
    values = read_json(file, "--truth")
    try:
        about = of_type(values, _About, "calibration")
        k = about.intrinsics
        pinhole = None if k is None else IndexedPinhole(about.width, about.height, k).camera()
    except ValueError as error:
        raise InputError(
            f"--truth {file} is unusable ({error}); expected JSON with width, height and, where known, "
            'intrinsics {"fx", "fy", "cx", "cy"} in pixels'
        ) from error
    numbered = _numbered(folder / "lidar_depth")
    return RecordedTruth(poses, (about.width, about.height), pinhole, numbered, None)


def _numbered(folder: Path) -> dict[int, Path]:
    """Files with points by the number that is their name; none where there is no folder."""
    files = sorted(folder.glob("*")) if folder.is_dir() else []
    return {int(f.stem): f for f in files if f.suffix in (".npz", ".png") and f.stem.isdecimal()}


def _inside(points: Float[np.ndarray, "n 3"], box: Cuboid) -> Bool[np.ndarray, " n"]:
    """Which points in the world, z up, lie in a box; its length lies along y at yaw 0."""
    c, s = np.cos(box.yaw), np.sin(box.yaw)
    world_from_box = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    local = (points - np.asarray(box.position)) @ world_from_box
    within = np.abs(local) <= np.asarray(box.size_wlh) / 2
    return within[:, 0] & within[:, 1] & within[:, 2]


def _table(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns, rows and depths as stored, places by integer pixel index."""
    try:
        stored = read_npz(path, ("u", "v", "depth"))
        u, v, depth = (stored[name].astype(np.float64) for name in ("u", "v", "depth"))
    except KeyError as error:
        raise InputError(f"{path} lacks the array {error}; expected arrays u, v and depth") from None
    usable = u.ndim == 1 and u.shape == v.shape == depth.shape and (np.abs([u, v]) <= MAX_SIDE_PX).all()
    if not (usable and ((depth > 0) & (depth <= FARTHEST_M)).all()):
        raise InputError(
            f"{path} holds u, v and depth of shapes {u.shape}, {v.shape} and {depth.shape}; expected three "
            "equally long lists of finite numbers, depths above 0"
        )
    return u, v, depth


def _picture(path: Path, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of a picture of depth, 0 where there is none."""
    picture = read_picture(path)
    if picture.dtype != np.uint16 or picture.shape != (size[1], size[0]):
        raise InputError(
            f"{path} holds {picture.dtype} of shape {picture.shape}; expected 16 bits of grey, 256 levels a "
            f"metre, {size[0]}x{size[1]} pixels"
        )
    v, u = np.nonzero(picture)
    return u.astype(np.float64), v.astype(np.float64), picture[v, u] / _PNG_PER_M
