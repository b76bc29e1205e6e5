"""Folders of ``dreamdrive world make``: what each camera records, and all truth beside it."""

import math
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from dreamdrive.data.array_file import read_npz
from dreamdrive.data.formats.cameras import IndexedPinhole
from dreamdrive.data.formats.rigid import JsonPose
from dreamdrive.data.layout_file import MOST_BOXES, read_layout
from dreamdrive.data.pictures.picture_file import read_picture
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, read_json
from dreamdrive.scene.camera import check_rigid
from dreamdrive.scene.street.hills import road_plane
from dreamdrive.scene.street.layout import Layout, Size
from dreamdrive.scene.street.truth import MOUNTS, DriveTruth, Mount, WorldBox
from dreamdrive.scene.trajectory import Trajectory

_MOST_PIXELS = 500_000_000
"""More pixels of all frames would take more than 20 GB with their depth, flow and labels."""


class _Hull(msgspec.Struct):
    """A road user of boxes.json."""

    instance: Annotated[int, Meta(ge=1, le=MOST_BOXES)]
    id: str
    kind: str
    moving: bool
    size_m: tuple[Size, Size, Size]
    world_from_box: list[JsonPose]


class _Path(msgspec.Struct):
    """What poses.json holds."""

    world_from_camera: Annotated[list[JsonPose], Meta(min_length=1)]
    times_s: Annotated[list[float], Meta(min_length=1)]


class _Hulls(msgspec.Struct):
    """What boxes.json holds."""

    boxes: list[_Hull]
    world_from_map: JsonPose


MARK = "layout.json"
"""By this file a world folder is known to readers."""


def is_world(path: Path) -> bool:
    """Whether a path is a world folder."""
    return (path / MARK).is_file() and any(
        (path / each / "cameras.json").is_file() for each in (".", *MOUNTS)
    )


def read_drives(path: Path) -> dict[Mount, DriveTruth]:
    """The drives of all cameras of a world folder, the front one first."""
    if (path / "frames").is_dir():
        return {"front": read_world(path)}
    return {mount: read_world(path, mount) for mount in MOUNTS if (path / mount).is_dir()}


def read_world(path: Path, camera: str = "front") -> DriveTruth:
    """Read the drive of one of a world folder's cameras; a folder of a single one holds that one alone."""
    if not (path / "layout.json").is_file():
        raise InputError(
            f"{path} is no world: layout.json is missing; expected a folder of dreamdrive world make"
        )
    layout = read_layout(path / "layout.json")
    folder = path if (path / "frames").is_dir() else path / camera
    if not folder.is_dir():
        raise InputError(f"{path} holds neither frames nor a camera {camera!r}; make the world again")
    try:
        return _read_camera(folder, layout)
    except (OSError, ValueError, MemoryError) as error:
        raise InputError(f"{folder} is not a complete world ({error}); make it again") from error


def _read_camera(folder: Path, layout: Layout) -> DriveTruth:
    calibration = folder / "cameras.json"
    pinhole = of_type(read_json(calibration), IndexedPinhole, str(calibration)).camera()
    stored = of_type(read_json(folder / "poses.json"), _Path, str(folder / "poses.json"))
    path = Trajectory(np.array(stored.world_from_camera), np.array(stored.times_s))
    hulls = of_type(read_json(folder / "boxes.json"), _Hulls, str(folder / "boxes.json"))
    if len(stored.world_from_camera) != len(path.times_s):
        raise ValueError(
            f"poses.json has {len(stored.world_from_camera)} poses for {len(path.times_s)} times"
        )
    times_s = path.times_s
    shape = len(times_s), pinhole.height_px, pinhole.width_px
    world_from_map = np.array(hulls.world_from_map)
    check_rigid(world_from_map, "world_from_map of boxes.json")
    _check_size(shape)
    return DriveTruth(
        frames=_images(folder / "frames", (*shape, 3))[..., ::-1].copy(),
        times_s=times_s,
        cameras=tuple(pinhole.at(pose) for pose in path.world_from_camera),
        depth_m=np.stack([_array(path, "depth_m", shape[1:]) for path in depth_files(folder, len(times_s))]),
        instance=_images(folder / "instances", shape).astype(np.int32),
        semantic=_images(folder / "semantics", shape),
        moving=_images(folder / "moving", shape) > 0,
        flow_px=_array(folder / "flow.npz", "flow_px", (*shape, 2)),
        boxes=tuple(_box(values, len(times_s)) for values in hulls.boxes),
        ground=road_plane(world_from_map, layout),
        layout=layout,
        world_from_map=world_from_map,
    )


def _check_size(shape: tuple[int, int, int]) -> None:
    """Whether the frames fit into memory with all that is known of each pixel, before any of it is taken."""
    count, height, width = shape
    if count * height * width > _MOST_PIXELS:
        raise ValueError(f"{count} frames of {width}x{height} are more than {_MOST_PIXELS:g} pixels")


def depth_files(folder: Path, count: int) -> list[Path]:
    """Where the depth of each frame of a camera's folder lies."""
    return [folder / "depth" / f"{i:04d}.npz" for i in range(count)]


def _images(folder: Path, shape: tuple[int, ...]) -> np.ndarray:
    images = np.zeros(shape, dtype=np.uint8)
    for i in range(len(images)):
        path = folder / f"{i:04d}.png"
        images[i] = _of_shape(path, read_picture(path, f"{path.parent.name}/{path.name}"), shape[1:])
    return images


def _array(path: Path, name: str, shape: tuple[int, ...]) -> np.ndarray:
    # At most of doubles.
    stored = read_npz(path, [name], at_most=8 * math.prod(shape))
    return _of_shape(path, stored.get(name), shape)


def _of_shape(path: Path, values: np.ndarray | None, shape: tuple[int, ...]) -> np.ndarray:
    if values is None or values.shape != shape:
        got = "no such array" if values is None else f"shape {values.shape}"
        raise ValueError(f"{path.name} of {path.parent.name} holds {got}, expected {shape}")
    return values


def _box(values: "_Hull", frames: int) -> WorldBox:
    poses = np.array(values.world_from_box)
    if len(poses) != frames:
        raise ValueError(f"box {values.id} of boxes.json has {len(poses)} poses for {frames} frames")
    check_rigid(poses, f"world_from_box of {values.id} in boxes.json")
    return WorldBox(values.instance, values.id, values.kind, values.moving, np.array(values.size_m), poses)
