"""Recordings of several cameras on one car: a folder with ``rig.json`` and the frames of each camera."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from jaxtyping import Float

from dreamdrive.data.clip_reader import read_clip
from dreamdrive.data.dataset import DataSet
from dreamdrive.data.formats.rigid import JsonPose
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, read_json, write_json
from dreamdrive.files.paths import is_path
from dreamdrive.scene.camera import check_rigid
from dreamdrive.scene.clip import Clip

RIG = "rig.json"
MOST_CAMERAS = 32
_EXPECTED = (
    'expected {"cameras": [{"frames": folder, "intrinsics": file, "car_from_camera": 4x4 in metres}, ...]}'
)


class _Entry(msgspec.Struct):
    frames: str
    car_from_camera: JsonPose
    intrinsics: str | None = None


class _Rig(msgspec.Struct):
    cameras: Annotated[list[_Entry], msgspec.Meta(min_length=1)]


@dataclass(frozen=True)
class _Mounted:
    """A camera of a rig: its frames, its calibration, and its pose in metres, x right, y down, z ahead."""

    frames: Path
    intrinsics: Path | None
    car_from_camera: Float[np.ndarray, "4 4"]


def is_rig(path: Path) -> bool:
    """Whether a path is a folder that describes several cameras."""
    return (path / RIG).is_file()


def read_rig(path: Path) -> tuple[_Mounted, ...]:
    """The cameras of a rig; paths in its file count from its folder."""
    try:
        listed = of_type(read_json(path / RIG, "input"), _Rig, str(path / RIG)).cameras
        mounted = tuple(_mounted(path, index, entry) for index, entry in enumerate(listed))
    except InputError as error:
        raise InputError(f"{error}; {_EXPECTED}") from None
    if len(mounted) > MOST_CAMERAS:
        raise InputError(
            f"{path / RIG} lists {len(mounted)} cameras; expected at most {MOST_CAMERAS} on one car"
        )
    return mounted


def write_rig(cameras: Mapping[str, Float[np.ndarray, "4 4"]], path: Path, calibration: str | None) -> None:
    """Describe cameras by name and pose, with ``NAME/frames`` and perhaps a calibration file in ``NAME``."""
    listed = [
        {
            "frames": f"{name}/frames",
            "intrinsics": None if calibration is None else f"{name}/{calibration}",
            "car_from_camera": pose,
        }
        for name, pose in cameras.items()
    ]
    write_json(path / RIG, {"cameras": listed})


def read_rig_clip(
    path: Path,
    *,
    frames: str | None = None,
    fps: float | None = None,
    size: tuple[int, int] | None = None,
    poses: Path | None = None,
    trajectory: Path | None = None,
    hold_out: int | None = None,
) -> Clip:
    """Read the frames of all cameras of a rig, with arguments as of ``read_clip`` for each of them.

    Poses and trajectory are those of the first camera; the mountings give the others. The cameras have to
    agree in their numbers of frames and in size.
    """
    cameras = read_rig(path)
    parts = [
        read_clip(
            camera.frames,
            frames=frames,
            fps=fps,
            size=size,
            intrinsics=camera.intrinsics,
            poses=poses if index == 0 else None,
            trajectory=trajectory if index == 0 else None,
            hold_out=hold_out,
        )
        for index, camera in enumerate(cameras)
    ]
    for camera, part in zip(cameras, parts, strict=True):
        if len(part) != len(parts[0]) or part.size != parts[0].size:
            got, wanted = (f"{len(p)} frames of {p.size[0]}x{p.size[1]}" for p in (part, parts[0]))
            raise InputError(
                f"{camera.frames} gives {got}, {cameras[0].frames} gives {wanted}; expected the same: cut "
                "the pictures to one shape, or leave the camera out of the rig"
            )
    return _woven(path, cameras, parts)


def _mounted(path: Path, index: int, entry: _Entry) -> _Mounted:
    name, given = f"{path / RIG}: camera {index}", entry.intrinsics
    for each in (entry.frames, *([] if given is None else [given])):
        if not is_path(each):
            raise InputError(f"{name} names {each!r}, which is no file name")
    pose = np.array(entry.car_from_camera)
    try:
        check_rigid(pose, "car_from_camera")
    except ValueError as error:
        raise InputError(f"{name} has no rigid pose: {error}") from None
    return _Mounted(path / entry.frames, None if given is None else path / given, pose)


def _woven(path: Path, cameras: tuple[_Mounted, ...], parts: list[Clip]) -> Clip:
    """One clip in the order of time, the cameras of a time in the order of the rig."""
    steps, count = len(parts[0]), len(parts)
    part, row = np.tile(np.arange(count), steps), np.repeat(np.arange(steps), count)
    # Cameras of a rig go off within a fraction of a frame: the first one's times stand for all.
    times_s = parts[0].times_s[row]
    first = parts[0].known.world_from_camera
    known = replace(parts[0].known, intrinsics=all(each.known.intrinsics for each in parts))
    if first is not None:
        from_first = np.linalg.inv(cameras[0].car_from_camera)
        mounted = np.stack([from_first @ camera.car_from_camera for camera in cameras])
        known = replace(known, world_from_camera=first[row] @ mounted[part])
    notes = [note for each in parts for note in each.provenance["notes"]]
    taken = parts[0].recorded
    return Clip(
        frames=np.stack([parts[p].frames[r] for p, r in zip(part, row, strict=True)]),
        times_s=times_s,
        camera=part,
        rig=tuple(each.rig[0].at(c.car_from_camera) for each, c in zip(parts, cameras, strict=True)),
        valid=np.stack([parts[p].valid[r] for p, r in zip(part, row, strict=True)]),
        held_out=parts[0].held_out[row],
        source_index=parts[0].source_index[row],
        known=known,
        requested=parts[0].requested,
        cuts=tuple(sorted(step * count + p for p, each in enumerate(parts) for step in each.cuts)),
        recorded=None if taken is None else replace(taken, path=str(path), lens=None),
        provenance={**parts[0].provenance, "notes": list(dict.fromkeys(notes))},
    )


RIG_FOLDER = DataSet(
    name="rig",
    about=f"a folder of several cameras with {RIG}",
    recognises=is_rig,
    read=read_rig_clip,
)
