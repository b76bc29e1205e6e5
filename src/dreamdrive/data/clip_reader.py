"""Reader of recordings: pinhole frames of one size, with times and whatever is known."""

from collections.abc import Callable
from functools import partial
from math import isfinite
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from dreamdrive.data.cameras.intrinsics import Calibration, calibration
from dreamdrive.data.cameras.poses import of_frames, read_pose_file
from dreamdrive.data.dataset import DataSet
from dreamdrive.data.feature_file import read_features
from dreamdrive.data.frames.cuts import find_cuts
from dreamdrive.data.frames.remarks import of_cuts, of_damage, of_missing_images, of_time_jumps
from dreamdrive.data.frames.select import MAX_FRAMES, Selection, held_out_mask, of_thinning, thinning
from dreamdrive.data.pictures.images import ImageFolder, RawFrame
from dreamdrive.data.pictures.sampler import Sampler, check_pictures, most_frames, too_many
from dreamdrive.data.pictures.video import RATES_HZ, Video
from dreamdrive.data.source import Source, one_frame, open_source
from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip, Known, Recorded
from dreamdrive.scene.trajectory import Trajectory

FOLDER_RATE_HZ = 10.0
"""Rate at which the images of a folder count unless told."""


def read_clip(
    path: Path,
    *,
    frames: str | None = None,
    fps: float | None = None,
    size: tuple[int, int] | None = None,
    intrinsics: Path | None = None,
    poses: Path | None = None,
    hfov_deg: float | None = None,
    trajectory: Path | None = None,
    features: Path | None = None,
    hold_out: int | None = None,
) -> Clip:
    """Read a video or a folder of images as a clip.

    The frames are undistorted to a pinhole with the source's focal length and axis, scaled and cropped, in
    one resampling; ``recorded.lens`` holds what gives a render the source's distortion back
    (``Lens.from_json``), or ``None``. Time 0 and the world are those of the first selected frame. Changes to
    another scene are ``cuts``; ``provenance["notes"]`` says in words what was noticed.

    Args:
        path: Video or folder of images.
        frames: ``START:STOP:STEP`` over source indices (file or decode order). Without it all, or where
            these are more than ``MAX_FRAMES`` every second one, every fourth, and so on.
        fps: Rate of the input before the step. Without it a video's own times count, and those that
            the names of images tell; else a folder has 10 Hz.
        size: Exact width and height; without it 480 wide, or the source's width if that is less.
        intrinsics: Calibration file (see ``intrinsics.read_intrinsics``).
        poses: Pose file (see ``poses.read_pose_file``).
        hfov_deg: Horizontal field of view of the source, instead of ``intrinsics``.
        trajectory: Path that whoever made the recording was asked to drive, in a pose file.
        features: Features of the source's pictures (see ``feature_file.read_features``).
        hold_out: Withhold the selected frames i with i mod N = N // 2.

    Raises:
        InputError: Anything about the input or the options that cannot be used, in one sentence.
    """
    if fps is not None and not (isfinite(fps) and fps > 0):
        raise InputError(f"--fps {fps:g}: expected a positive number of frames a second")
    source = open_source(path)
    chosen = Selection.parse(frames)
    thin = _thinning(source, fps) if chosen.is_whole else _all_of_them
    sampler, read = _gather(source, chosen, size, lambda of: calibration(of, intrinsics, hfov_deg), thin)
    index, clock_s = np.array([raw.index for raw in read]), [raw.time_s for raw in read]
    times_s, said = _times(source, index, clock_s, fps)
    listed = source.notes if isinstance(source, ImageFolder) else ()
    said += of_thinning(int(index[1] - index[0])) if chosen.is_whole else ()
    notes = [*listed, *said, *dict.fromkeys(note for raw in read for note in raw.notes), *sampler.notes]

    def poses_in(file: Path | None, option: str) -> Float[np.ndarray, "f 4 4"] | None:
        if file is None:
            return None
        rows = read_pose_file(file, option, path.resolve().name)
        found, said = of_frames(rows, index, times_s, source.count)
        notes.extend(said)
        return found

    known_poses, asked = poses_in(poses, "--poses"), poses_in(trajectory, "--trajectory")
    frames_rgb, valid = _stacked(read, path)
    found = find_cuts(frames_rgb, valid)
    notes += [
        *of_damage([raw.index for raw in read if raw.damaged]),
        *_gaps(source, index, clock_s, fps),
        *of_cuts(found, index),
    ]
    given = None if features is None else read_features(features).of_frames(index, source.count, features)
    return Clip(
        frames=frames_rgb,
        times_s=times_s - times_s[0],
        camera=np.zeros(len(index), dtype=np.int64),
        rig=(sampler.camera,),
        valid=valid,
        held_out=held_out_mask(len(index), hold_out),
        source_index=index,
        features={} if given is None else given.cropped(sampler.sizing, sampler.lens, features),
        known=Known(
            world_from_camera=known_poses,
            intrinsics=sampler.calibration.known,
            hfov=sampler.calibration.hfov,
        ),
        requested=None if asked is None else Trajectory(asked, times_s - times_s[0]),
        cuts=tuple(cut.first for cut in found.cuts),
        recorded=_recorded(source, sampler),
        provenance={"notes": notes} | ({} if given is None else {"features": given.provenance}),
    )


def _thinning(source: Source, fps: float | None) -> Callable[[int], int]:
    """The step between frames of so many, none of which somebody chose."""
    rate_hz = fps or (source.rate_hz if isinstance(source, Video) else None) or FOLDER_RATE_HZ
    return partial(thinning, rate_hz=rate_hz, most=MAX_FRAMES)


def _all_of_them(count: int) -> int:
    """The step between frames that somebody chose."""
    return 1


def _gather(
    source: Source,
    selection: Selection,
    size: tuple[int, int] | None,
    calibrated: Callable[[tuple[int, int]], Calibration],
    thin: Callable[[int], int],
) -> tuple[Sampler, list[RawFrame]]:
    """The selected frames, each brought to the clip's size as it comes; ``thin`` tells their step."""
    count = source.count() if selection.needs_count or isinstance(source, ImageFolder) else None
    wanted = selection.resolve(count, str(source.path))
    sampler: Sampler | None = None
    read, most, step = list[RawFrame](), 0, 1
    for raw in source.read(wanted if count is None else wanted[:: thin(count)]):
        if count is None and (wider := thin(raw.index + 1)) > step:
            # A video does not tell how many frames it has: those that were read are thinned.
            read, step = read[:: wider // step], wider
        if raw.index % step:
            continue
        if sampler is None:
            sampler = Sampler.create(raw.size, size, calibrated(raw.size))
            most = most_frames(sampler.sizing.target)
        if raw.size != sampler.sizing.source:
            (w, h), (w2, h2) = sampler.sizing.source, raw.size
            raise InputError(
                f"{source.path}: {read[0].name} is {w}x{h} but {raw.name} is {w2}x{h2}; "
                "expected frames of one size"
            )
        if len(read) == most:
            raise too_many(most, sampler.sizing.target, source.path)
        read.append(sampler(raw))
    if sampler is None or len(read) < 2:
        raise one_frame(source.path)
    return sampler, read


def _stacked(
    read: list[RawFrame], path: Path
) -> tuple[UInt8[np.ndarray, "f h w 3"], Bool[np.ndarray, "f h w"]]:
    """The frames and where they hold a picture; refuses frames of nothing."""
    valid = np.array([raw.opaque for raw in read], bool)
    if not valid.any():
        raise InputError(
            f"{path}: every pixel is transparent or outside the calibrated lens; nothing is left"
        )
    frames_rgb = np.stack([raw.rgb for raw in read])
    check_pictures(frames_rgb, valid, path)
    return frames_rgb, valid


def _times(
    source: Source, index: Int[np.ndarray, " f"], clock_s: list[float | None], fps: float | None
) -> tuple[Float[np.ndarray, " f"], tuple[str, ...]]:
    """Seconds since frame 0 of the source, and what to say about them."""
    if fps is not None:
        return index / fps, ()
    if all(t is not None for t in clock_s):
        times_s = np.array(clock_s, dtype=np.float64)
        rate = (index[-1] - index[0]) / max(times_s[-1] - times_s[0], 1e-12)
        if (np.diff(times_s) > 0).all() and RATES_HZ[0] <= rate <= RATES_HZ[1]:
            named = f"The images' names tell their times: {rate:.3g} Hz in the mean."
            return times_s, () if isinstance(source, Video) else (named,)
    if not isinstance(source, Video):
        return index / FOLDER_RATE_HZ, (f"No --fps was given: the images count as {FOLDER_RATE_HZ:g} Hz.",)
    if source.rate_hz is None:
        raise InputError(f"{source.path} has no usable times; give its rate with --fps")
    return index / source.rate_hz, (
        f"The video's own times are unusable: its frames count as {source.rate_hz:g} Hz.",
    )


def _gaps(
    source: Source, index: Int[np.ndarray, " f"], clock_s: list[float | None], fps: float | None
) -> list[str]:
    """What to say about frames that are missing inside the selection."""
    told = fps is None and all(t is not None for t in clock_s)
    if isinstance(source, ImageFolder) and not told:
        return of_missing_images(source.files[index[0] : index[-1] + 1])
    if not told:
        return []
    return of_time_jumps(index, np.array(clock_s, dtype=np.float64))


def _recorded(source: Source, sampler: Sampler) -> Recorded:
    sizing = sampler.sizing
    lens = None if sampler.lens is None else sampler.lens.to_json()
    is_video = isinstance(source, Video)
    return Recorded(str(source.path), is_video, sizing.source, sizing.scaled, sizing.offset, lens)


RECORDING = DataSet(
    name="recording",
    about="a video or a folder of images",
    recognises=lambda path: True,  # what it is not is said by whoever opens it
    read=read_clip,
    deep=False,
)
