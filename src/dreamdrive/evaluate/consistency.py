"""Consistency of a video: it keeps to the path it was asked for, and shows one and the same world."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.errors import InputError
from dreamdrive.evaluate.epipolar import EpipolarShare, epipolar_share
from dreamdrive.evaluate.warp_error import WarpError, warp_error
from dreamdrive.files.output import temporary_folder
from dreamdrive.geometry.cameras import MIN_TRACKS, fill, odometry, settle, sfm
from dreamdrive.geometry.evidence import Evidence, Features, features, observe, resized, working_frames
from dreamdrive.metrics.paths import PathError, compare_paths
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.geometry import Ground
from dreamdrive.scene.trajectory import Trajectory

GAPS = (1, 4, 8)
MIN_PLACED = 0.9
"""Share of the frames that structure from motion has to place."""
_ROAD = Ground(np.array([0.0, -1.0, 0.0]), 1.5)
"""For odometry; its height sets no more than the unit, which a comparison of paths leaves free."""


@dataclass(frozen=True)
class GapFigures:
    """What pairs of frames show that lie ``gap`` frames apart; None without such a pair, or without poses."""

    gap: int
    epipolar: EpipolarShare | None
    warp: WarpError | None


@dataclass(frozen=True)
class Consistency:
    """Figures of one video; see docs/reference/evaluate_consistency.md for what they tell.

    Attributes:
        frames: Number of frames.
        width_px: Width of the frames, on which the figures in pixels depend.
        path: The path found in the video against the one asked for; None where either is missing or the one
            asked for stands still.
        found_by: What found the path in the video: ``"structure from motion"``, ``"odometry"`` (rougher),
            ``"standing"`` (nothing moves) or None.
        lines_from: Whose poses the epipolar lines follow from: ``"asked"``, or ``"found"`` where no path was
            asked for, or None.
        gaps: Figures of pairs of frames 1, 4 and 8 apart.
        notes: What else to know, a sentence each.
    """

    frames: int
    width_px: int
    path: PathError | None
    found_by: str | None
    lines_from: Literal["asked", "found"] | None
    gaps: tuple[GapFigures, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Recovered:
    """A path found in the frames, in an arbitrary unit.

    The pinhole has the clip's size; a focal length that was not calibrated is refined if it shows.
    """

    world_from_camera: Float[np.ndarray, "f 4 4"]
    camera: Camera
    method: Literal["structure from motion", "odometry", "standing"]


def evaluate_consistency(
    frames: UInt8[np.ndarray, "f h w 3"],
    times_s: Float[np.ndarray, " f"],
    intrinsics: Camera,
    asked: Trajectory | None = None,
    *,
    calibrated: bool = True,
    valid: Bool[np.ndarray, "f h w"] | None = None,
    moving: Bool[np.ndarray, "f h w"] | None = None,
    seed: int = 0,
) -> Consistency:
    """Measure how precisely a video follows a path and how well its frames agree, as the paper compares them.

    The same frames, options and seed give the same figures.

    Args:
        frames: RGB (F, H, W, 3) of one camera.
        times_s: Times (F,), strictly increasing.
        intrinsics: Pinhole of the frames' size; its pose does not count.
        asked: The path that the video was to follow, one pose a frame; their times do not count.
        calibrated: Whether the focal length is known rather than guessed.
        valid: False where a frame holds no picture (F, H, W).
        moving: Pixels of moving things (F, H, W), which the path and the epipolar lines leave out.
        seed: Seed of everything random.

    Raises:
        InputError: Fewer than two frames, or another number of poses than of frames.
    """
    if len(frames) < 2:
        raise InputError(f"consistency: got {len(frames)} frames; expected at least two of one drive")
    if asked is not None and len(asked) != len(frames):
        raise InputError(
            f"consistency: the trajectory has {len(asked)} poses but the video has {len(frames)} frames; "
            "give the trajectory that this video was asked for, one pose a frame"
        )
    clip = _clip(frames, times_s, intrinsics, calibrated, valid)
    seen = observe(clip)
    found, path = _followed(clip, seen, moving, seed)
    error = None if path is None or asked is None else compare_paths(path.world_from_camera, _poses(asked))
    camera, poses, whose = _lines(clip, path, asked)
    gaps = tuple(_gap(clip, seen, found, camera, poses, gap) for gap in GAPS)
    notes = tuple(_notes(clip, path, asked, whose))
    method = None if path is None else path.method
    return Consistency(len(clip), clip.size[0], error, method, whose, gaps, notes)


def _clip(
    frames: np.ndarray, times_s: np.ndarray, camera: Camera, calibrated: bool, valid: np.ndarray | None
) -> Clip:
    count, height, width = frames.shape[:3]
    if (camera.width_px, camera.height_px) != (width, height):
        raise ValueError(
            f"consistency: intrinsics of {camera.width_px}x{camera.height_px} for frames of {width}x{height}"
        )
    return Clip(
        frames=frames,
        times_s=times_s,
        camera=np.zeros(count, np.int64),
        rig=(camera.at(np.eye(4)),),
        valid=np.ones(frames.shape[:3], bool) if valid is None else valid,
        held_out=np.zeros(count, bool),
        source_index=np.arange(count),
        known=Known(intrinsics=calibrated),
    )


def _followed(
    clip: Clip, seen: Evidence, moving: np.ndarray | None, seed: int
) -> tuple[list[Features], Recovered | None]:
    """Features of what stands still, and the path that they and the road show."""
    grey, usable = working_frames(clip, seen)
    street = seen.street
    if moving is not None:
        usable = usable & ~resized(moving, usable.shape[:0:-1])
        street = street & ~resized(moving, street.shape[:0:-1])
    found = features.extract(grey, usable)
    return found, _recovered(clip, seen, street, found, seed)


def _recovered(
    clip: Clip, seen: Evidence, street: Bool[np.ndarray, "f h w"], found: Sequence[Features], seed: int
) -> Recovered | None:
    """Find the path of a clip of one camera; None where the frames show none.

    Structure from motion counts here even where ``geometry.reconstruct`` refuses it as too coarse to build a
    scene on: its residual is what inconsistent frames look like.

    The street that stands still is given at the size of ``seen.grey``, features at that of ``seen.working``.
    """
    camera = clip.rig[0]
    if seen.motion.tracks < MIN_TRACKS:
        return None
    if seen.motion.standing:
        return Recovered(np.tile(np.eye(4), (len(clip), 1, 1)), camera, "standing")
    mapped = _mapped(clip, seen, found, seed)
    if mapped is not None:
        return mapped
    path = odometry.drive(seen.grey, street, seen.small, clip.times_s, _ROAD)
    return Recovered(path.world_from_camera, camera, "odometry") if path.measured else None


def _mapped(clip: Clip, seen: Evidence, found: Sequence[Features], seed: int) -> Recovered | None:
    with temporary_folder() as folder:
        database = folder / "matches.db"
        sfm.match(database, found, seen.working, seed)
        model = sfm.map_globally(database, len(clip), seed)
        if model is None or model.registered.mean() < MIN_PLACED:
            return None
        camera = clip.rig[0]
        if not clip.known.intrinsics:
            settled = settle(database, model, seen.working, False, seed)
            if settled.model.registered.mean() < MIN_PLACED:
                return None
            model, factor = settled.model, float(settled.model.lens[0]) / seen.working.fx_px
            camera = replace(camera, fx_px=camera.fx_px * factor, fy_px=camera.fy_px * factor)
    return Recovered(fill(model.world_from_camera, clip.times_s), camera, "structure from motion")


def _poses(path: Trajectory) -> Float[np.ndarray, "f 4 4"]:
    return path.world_from_camera.astype(np.float64)


def _lines(
    clip: Clip, path: Recovered | None, asked: Trajectory | None
) -> tuple[Camera, Float[np.ndarray, "f 4 4"] | None, Literal["asked", "found"] | None]:
    """Pinhole and poses that the epipolar lines follow from, and whose poses they are."""
    camera = clip.rig[0] if path is None else path.camera
    if asked is not None:
        return camera, _poses(asked), "asked"
    if path is not None and path.method != "standing":
        return camera, path.world_from_camera, "found"
    return camera, None, None


def _gap(
    clip: Clip,
    seen: Evidence,
    found: list[Features],
    camera: Camera,
    poses: Float[np.ndarray, "f 4 4"] | None,
    gap: int,
) -> GapFigures:
    if gap >= len(clip):
        return GapFigures(gap, None, None)
    working = camera.resized(seen.working.width_px, seen.working.height_px)
    lines = None if poses is None else epipolar_share(found, working, poses, gap, clip.size[0])
    return GapFigures(gap, lines, warp_error(clip, gap))


def _notes(
    clip: Clip, path: Recovered | None, asked: Trajectory | None, whose: Literal["asked", "found"] | None
) -> list[str]:
    notes: list[str] = []
    if not clip.known.intrinsics:
        notes.append("The focal length is not calibrated: where it is wrong, turns are measured wrongly.")
    if path is None:
        notes.append("No path could be found in the video: it shows too little to follow.")
    elif path.method == "odometry":
        notes.append("Structure from motion failed: the path is that of frame-to-frame odometry and rough.")
    elif path.method == "standing":
        notes.append("The camera of the video stands still.")
    if asked is not None and asked.length_m == 0:
        notes.append("The path asked for stands still: errors over its length have no meaning.")
    if whose == "found":
        notes.append("No path was asked for: the epipolar lines are those of the path found in the video.")
    missing = [str(gap) for gap in GAPS if gap >= len(clip)]
    if missing:
        notes.append(f"{len(clip)} frames are too few for pairs {' and '.join(missing)} frames apart.")
    return notes
