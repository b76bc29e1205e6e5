"""True cameras and depth of a scene's frames, of a simulated world or of a recording with lidar."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Shaped

from dreamdrive.data.frames.size import Sizing, choose_size
from dreamdrive.data.truth_folder import read_world
from dreamdrive.errors import InputError
from dreamdrive.evaluate.estimate import Estimate
from dreamdrive.evaluate.truth.drawn import drawn_again
from dreamdrive.evaluate.truth.recorded import DepthPoints, RecordedTruth, read_cameras_json, read_poses_txt
from dreamdrive.files.given import TRUTH, check_there
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.truth import DriveTruth


@dataclass(frozen=True)
class GeometryTruth:
    """Known cameras and depth of F frames, on their pixels, in metres, in a world of their own.

    Attributes:
        cameras: One posed pinhole a frame.
        depth_m: Depth along z (F, H, W); 0 where it is not known, in the sky too.
        moving: Pixels of what moves (F, H, W), telling nothing where there is no depth; None where not known.
        calibrated: Whether the pinholes are true, and not only the poses.
        notes: What else to know, a sentence each.
    """

    cameras: tuple[Camera, ...]
    depth_m: Float[np.ndarray, "f h w"]
    moving: Bool[np.ndarray, "f h w"] | None
    calibrated: bool = True
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        shape = len(self.cameras), self.cameras[0].height_px, self.cameras[0].width_px
        for name in ("depth_m", "moving"):
            values = getattr(self, name)
            if values is not None and values.shape != shape:
                raise ValueError(f"geometry truth: {name} of shape {values.shape}, expected {shape}")


def read_geometry_truth(path: Path, estimate: Estimate) -> GeometryTruth:
    """The truth of the frames of an estimate, on their pixels.

    Args:
        path: What ``TRUTH`` lists; its content decides which it is.
        estimate: Whose frames are asked for; frame k of its source is frame k of the truth.

    Raises:
        InputError: It is none of these, or damaged, or has other frames.
    """
    check_there(path, TRUTH)
    if path.is_file():
        drawn = drawn_again(path, estimate.index, estimate.times_s, estimate.size)
        return of_drive(drawn, estimate, path)
    if (path / "layout.json").is_file():
        return of_drive(read_world(path), estimate, path)
    if (path / "cameras.json").is_file():
        return of_recording(read_cameras_json(path, estimate.source), estimate, path)
    if (path / "poses.txt").is_file():
        return of_recording(read_poses_txt(path), estimate, path)
    raise InputError(
        f"{path} holds no truth: neither layout.json nor cameras.json nor poses.txt; expected {TRUTH}"
    )


def of_drive(made: DriveTruth, estimate: Estimate, path: Path) -> GeometryTruth:
    """The exact truth of a simulated drive; a pixel takes that of the true pixel under its centre."""
    first, rows = made.cameras[0], estimate.index
    sizing = _sizing(len(made.cameras), (first.width_px, first.height_px), estimate, path)
    return GeometryTruth(
        cameras=tuple(sizing.camera(made.cameras[i]) for i in rows.tolist()),
        depth_m=_nearest(made.depth_m[rows], sizing),
        moving=_nearest(made.moving[rows], sizing),
    )


def of_recording(recorded: RecordedTruth, estimate: Estimate, path: Path) -> GeometryTruth:
    """The truth of a recording; of several points in a pixel the nearest counts, which hides the others."""
    sizing = _sizing(len(recorded.world_from_camera), recorded.size, estimate, path)
    poses = [recorded.world_from_camera[i] for i in estimate.index.tolist()]
    if recorded.pinhole is not None:
        cameras = tuple(sizing.camera(recorded.pinhole).at(pose) for pose in poses)
    else:
        cameras = tuple(c.at(pose) for c, pose in zip(estimate.cameras, poses, strict=True))
    shape = len(cameras), estimate.size[1], estimate.size[0]
    depth_m, moving = np.zeros(shape, dtype=np.float32), np.zeros(shape, dtype=bool)
    for frame, index in enumerate(estimate.index.tolist()):
        if index in recorded.depth_files:
            _splat(recorded.points(index), sizing, depth_m[frame], moving[frame])
    notes: list[str] = []
    if estimate.undistorted:
        notes.append("The scene's frames were undistorted; the points of the truth are taken as undistorted.")
    known = moving if recorded.boxes is not None else None
    return GeometryTruth(cameras, depth_m, known, recorded.pinhole is not None, tuple(notes))


def _sizing(count: int, true: tuple[int, int], estimate: Estimate, path: Path) -> Sizing:
    """How frames of the truth became frames of the scene, as the reader of clips does it."""
    last = int(estimate.index.max())
    if last >= count:
        raise InputError(
            f"{path} knows {count} frames but the scene shows frame {last} of its source; "
            "give the truth of the recording that the scene was made from"
        )
    try:
        return choose_size(true, estimate.size)
    except InputError as error:
        (width, height), (true_width, true_height) = estimate.size, true
        raise InputError(
            f"the scene's frames are {width}x{height}, those of {path} {true_width}x{true_height}; expected "
            "the same shape: give the truth of the recording that the scene was made from"
        ) from error


def _nearest(maps: Shaped[np.ndarray, "f _ _"], sizing: Sizing) -> Shaped[np.ndarray, "f h w"]:
    """Each map at the size of the clip, by the pixel under each centre."""
    columns, rows = (_under(sizing, axis) for axis in (0, 1))
    return maps[:, rows[:, None], columns]


def _under(sizing: Sizing, axis: int) -> Shaped[np.ndarray, " n"]:
    centres = np.arange(sizing.target[axis]) + 0.5 + sizing.offset[axis]
    return (centres * sizing.source[axis] / sizing.scaled[axis]).astype(np.int64)


def _splat(
    points: DepthPoints, sizing: Sizing, depth_m: Float[np.ndarray, "h w"], moving: Bool[np.ndarray, "h w"]
) -> None:
    """Write points into the maps of one frame."""
    place = points.place_px * np.divide(sizing.scaled, sizing.source) - sizing.offset
    column, row = np.floor(place).astype(np.int64).T
    inside = (column >= 0) & (column < sizing.target[0]) & (row >= 0) & (row < sizing.target[1])
    far_first = np.flatnonzero(inside)[np.argsort(-points.depth_m[inside], kind="stable")]
    # Of equal indices NumPy keeps the last.
    depth_m[row[far_first], column[far_first]] = points.depth_m[far_first]
    moving[row[far_first], column[far_first]] = points.moving[far_first]
