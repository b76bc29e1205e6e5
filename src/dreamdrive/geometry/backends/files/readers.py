"""Each format as ``FileGeometry``: the poses, cameras and depth of the frames that are wanted.

What ``dreamdrive.data.formats`` parses is brought to the frames here, and refused where it does not fit them.
Our own format, a folder, is

- ``cameras.json``: ``{"width", "height", "intrinsics": {"fx", "fy", "cx", "cy"},
  "world_from_camera": [4x4, ...], "frames": [index, ...]}``. Pixels are counted by integer index (the first
  pixel's centre is 0), axes are x right, y down, z forward, lengths are metres. ``frames`` names the source
  frame of each pose and may be left out when there is one for each source frame, in order.
- ``depth/NNNN.npz`` (array ``depth_m``, metres) or ``depth/NNNN.png`` (16 bit, millimetres), or .npy, .exr,
  NNNN the source frame. Frames without a file have no depth; the folder may be missing.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any, cast

import msgspec
import numpy as np
from jaxtyping import Float, Int

from dreamdrive.data.cameras.poses import of_frames, read_pose_file
from dreamdrive.data.formats.cameras import IndexedPinhole, LensCamera
from dreamdrive.data.formats.colmap import colmap_camera, find_colmap, read_colmap
from dreamdrive.data.formats.nerfstudio import (
    USUAL_FACTOR,
    depth_file,
    frame_camera,
    frame_names,
    frame_poses,
    transforms_frames,
)
from dreamdrive.data.formats.pandaset import pandaset_camera
from dreamdrive.data.formats.pose_lists import kitti_camera
from dreamdrive.data.formats.rigid import clean_poses, numbers, pose_name
from dreamdrive.errors import InputError
from dreamdrive.files.json_file import of_type, read_json
from dreamdrive.geometry.backends.files.depth import ENDINGS, find_depth
from dreamdrive.geometry.backends.files.given import (
    NAME,
    OPTION,
    Declared,
    DepthFiles,
    FileGeometry,
    SparsePoints,
    read_declared,
)
from dreamdrive.geometry.backends.files.wanted import Wanted
from dreamdrive.scene.camera import Camera

CALIBRATION = "calib.txt"
MAX_POINTS = 20_000
"""Points of COLMAP's that are kept, those seen most often: enough for the road and for the scale."""
_NEEDED = ("width", "height", "intrinsics", "world_from_camera")


class _NamedFrames(msgspec.Struct):
    frames: list[int] | None = None


def read_colmap_model(path: Path, wanted: Wanted) -> FileGeometry:
    """Read a COLMAP model; pictures that were not registered count as missing.

    It lies in the folder that was given, or in its ``sparse/0``. Depth may lie in a folder ``depth`` in the
    folder that was given, called like the images.
    """
    folder = find_colmap(path) or path
    model = read_colmap(folder)
    images = [image for _, image in sorted(model.images.items()) if image.has_pose]
    if not images:
        raise InputError(f"{folder}: the COLMAP model has no picture with a pose")
    rows, notes = wanted.rows([image.name for image in images], str(folder))
    chosen = [images[row] for row in rows]
    from_world = np.tile(np.eye(4), (len(chosen), 1, 1))
    from_world[:, :3] = [image.cam_from_world().matrix() for image in chosen]
    # Cleaned first: an inverse by the transpose wants true rotations.
    from_world = clean_poses(from_world, str(folder), lambda row: f"the pose of {chosen[row].name}")
    declared = read_declared(path)
    stems = [PurePosixPath(image.name).stem for image in chosen]
    return FileGeometry(
        np.linalg.inv(from_world),
        metric=declared.metric is True,
        cameras=[colmap_camera(model.cameras[image.camera_id], str(folder)) for image in chosen],
        depth=find_depth(path / "depth", stems, declared),
        sparse=_sparse(model, np.array([image.image_id for image in chosen])),
        notes=notes,
    )


def _sparse(model: Any, image_ids: Int[np.ndarray, " f"]) -> SparsePoints | None:
    longest = sorted(model.points3D.items(), key=lambda item: (-item[1].track.length(), item[0]))
    row = {int(image): frame for frame, image in enumerate(image_ids)}
    kept: list[np.ndarray] = []
    seen: list[list[int]] = []
    for _, point in longest[:MAX_POINTS]:
        frames = [row[e.image_id] for e in point.track.elements if e.image_id in row]
        if frames and np.isfinite(point.xyz).all():
            kept.append(np.array(point.xyz))
            seen.append(frames)
    if not kept:
        return None
    mask = np.zeros((len(image_ids), len(kept)), bool)
    for index, frames in enumerate(seen):
        mask[frames, index] = True
    return SparsePoints(np.array(kept), mask)


def read_transforms(path: Path, wanted: Wanted) -> FileGeometry:
    """Read a ``transforms.json`` and the depth that it names."""
    record = read_json(path, OPTION)
    frames = transforms_frames(record, str(path))
    rows, notes = wanted.rows(frame_names(frames, str(path)), str(path))
    chosen = [frames[row] for row in rows]
    declared = read_declared(path.parent)
    cameras = [frame_camera(frame, f"{path}: {frame['file_path']}") for frame in chosen]
    depth, said = _named_depth(record, chosen, declared, path)
    return FileGeometry(
        frame_poses(chosen, str(path)),
        metric=declared.metric is True,
        cameras=cameras,
        depth=depth,
        notes=notes + said,
    )


def _named_depth(
    record: Mapping[str, Any], frames: Sequence[Mapping[str, Any]], declared: Declared, path: Path
) -> tuple[DepthFiles, tuple[str, ...]]:
    of: dict[int, Path] = {}
    for row, frame in enumerate(frames):
        file = depth_file(path, frame)
        if file is None:
            continue
        if not file.is_file() or file.suffix.lower() not in ENDINGS:
            raise InputError(
                f"{path}: depth_file_path {frame['depth_file_path']} of {frame['file_path']} is no file that "
                f"can be read ({', '.join(ENDINGS)})"
            )
        of[row] = file
    if declared.depth_unit is not None:
        return DepthFiles(of, declared.depth_unit, not declared.depth_in_poses_unit), ()
    factor = record.get("depth_unit_scale_factor", USUAL_FACTOR)
    if isinstance(factor, bool) or not isinstance(factor, (int, float)) or not 0 < factor < 1e6:
        raise InputError(f"{path}: depth_unit_scale_factor is {factor!r}; expected a positive number")
    said = ()
    if of and "depth_unit_scale_factor" not in record:
        said = (f"{path.name} has no depth_unit_scale_factor: stored depth times {USUAL_FACTOR} is taken.",)
    return DepthFiles(of, float(factor), metric=False), said


def read_pandaset(path: Path, wanted: Wanted) -> FileGeometry:
    """Read one camera: that of ``geometry.json``, the only one, or the one that is called like the input."""
    record = read_json(path, OPTION)
    declared = read_declared(path.parent)
    cameras = cast("dict[str, Any]", record["cameras"])
    name = declared.camera or (next(iter(cameras)) if len(cameras) == 1 else wanted.folder)
    if name not in cameras:
        raise InputError(
            f"{path} has the cameras {', '.join(cameras)}, none called {name!r}: name the input folder "
            f'like its camera, or write {{"camera": NAME}} into {NAME} beside it'
        )
    found = pandaset_camera(record, f"{OPTION} {path}", name)
    poses, notes = of_frames(found.rows, wanted.index, wanted.times_s, wanted.count)
    return _metres(path.parent, poses, found.pinhole(), wanted.labels, declared, notes)


def read_plain(path: Path, wanted: Wanted) -> FileGeometry:
    """Read our own ``cameras.json`` and the depth beside it."""
    record = read_json(path, OPTION)
    if any(key not in record for key in _NEEDED):
        raise InputError(f"{path}: expected an object with {', '.join(_NEEDED)}")
    try:
        camera = of_type(record, IndexedPinhole, str(path)).camera()
    except ValueError as error:
        raise InputError(f"{path}: width, height and intrinsics fx, fy, cx, cy expected ({error})") from error
    where = f"{path}: world_from_camera"
    matrices = numbers(record["world_from_camera"], where)
    named = of_type(record, _NamedFrames, str(path)).frames
    frames = list(range(len(matrices) if matrices.ndim else 0)) if named is None else named
    if matrices.ndim != 3 or len(frames) != len(matrices):
        raise InputError(f"{path}: {len(frames)} frames for world_from_camera of shape {matrices.shape}")
    poses = clean_poses(matrices, where, pose_name)
    row = {frame: k for k, frame in enumerate(frames)}
    asked = wanted.index.tolist()
    if missing := [frame for frame in asked if frame not in row]:
        raise InputError(f"{path}: has no pose for the selected frames {missing[:5]}")
    labels = [f"{frame:04d}" for frame in asked]
    chosen = poses[[row[frame] for frame in asked]]
    return _metres(path.parent, chosen, camera, labels, read_declared(path.parent))


def read_pose_list(path: Path, wanted: Wanted) -> FileGeometry:
    """Read KITTI, TUM or Trajectory JSON, and KITTI's ``calib.txt`` beside it, for the source's pictures.

    KITTI's poses are those of camera 0: those of another camera, which ``geometry.json`` or an input folder
    such as ``image_2`` names, lie beside them by the last column of its P.
    """
    declared = read_declared(path.parent)
    rows = read_pose_file(path, OPTION)
    poses, notes = of_frames(rows, wanted.index, wanted.times_s, wanted.count)
    calibration = path.parent / CALIBRATION
    if not calibration.is_file():
        return _metres(path.parent, poses, None, wanted.labels, declared, notes)
    number = re.fullmatch(r"(?:P|image_0?)([0-3])", declared.camera or wanted.folder)
    name = f"P{number[1] if number else 0}"
    camera, beside = kitti_camera(calibration, name, wanted.picture)
    said = f"The poses of {path.name} count as those of KITTI's camera 0, the clip as camera {name[1]}."
    given = _metres(path.parent, poses @ beside, camera, wanted.labels, declared, (*notes, said))
    return replace(given, depth=replace(given.depth, kitti=True))


def _metres(
    folder: Path,
    poses: Float[np.ndarray, "f 4 4"],
    camera: Camera | None,
    labels: Sequence[str],
    declared: Declared,
    notes: tuple[str, ...] = (),
) -> FileGeometry:
    """Poses of one camera, metric unless that is denied, and the depth in the folder beside them."""
    return FileGeometry(
        poses,
        metric=declared.metric is not False,
        cameras=() if camera is None else (LensCamera(camera, None),) * len(poses),
        depth=find_depth(folder / "depth", labels, declared),
        notes=notes,
    )
