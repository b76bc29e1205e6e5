"""Reader of the photo, or the first frames, that a video model starts from."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from dreamdrive.data.cameras.intrinsics import Calibration, calibration
from dreamdrive.data.cameras.lens import SourceLens, Undistorter
from dreamdrive.data.frames.remarks import of_damage
from dreamdrive.data.frames.select import UNBOUNDED
from dreamdrive.data.frames.size import cover
from dreamdrive.data.pictures.exif import PhotoFacts, read_exif
from dreamdrive.data.pictures.images import SUFFIXES, RawFrame, read_image
from dreamdrive.data.pictures.panorama import USUAL_HFOV_DEG, is_panorama, view_of
from dreamdrive.data.pictures.video import Video
from dreamdrive.data.source import open_source
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera

_WORTH_A_NOTE = 0.02
_ROUNDING = 1e-6
_HALF_STEP = 0.5 + _ROUNDING


@dataclass(frozen=True)
class Photo:
    """A picture of a street as a pinhole at the identity sees it, with sentences for the report.

    ``calibrated`` tells a calibrated pinhole from a guess, ``hfov`` a guess from a told field of view.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    camera: Camera
    calibrated: bool
    notes: tuple[str, ...]
    hfov: bool = False


def read_photo(
    path: Path,
    size: tuple[int, int],
    intrinsics: Path | None = None,
    hfov_deg: float | None = None,
    view: tuple[float, float] | None = None,
) -> Photo:
    """Read a photo, or the first frame of a recording, at the size (width, height) that a model wants.

    It is scaled to cover the size and cut around its centre; a known distortion is taken out of it.
    Calibration as of ``intrinsics.calibration``; without one the focal length of the photo's EXIF data counts
    as a field of view that was told. Of a panorama, ``view`` is the heading and pitch of what is taken, in
    degrees, and ``hfov_deg`` its field of view.
    """
    (raw,), notes = leading_frames(path, 1)
    if view is not None:
        if intrinsics is not None:
            raise InputError("--view takes a pinhole out of a panorama; leave --intrinsics out")
        return _out_of_panorama(path, raw, size, view, hfov_deg or USUAL_HFOV_DEG)
    if not is_photo(path):
        notes.append(f"The video goes on from the first frame of {path.name}.")
    elif is_panorama(raw.size):
        notes.append(
            f"{path.name} is twice as wide as high; --view HEADING,PITCH takes a view out of a panorama."
        )
    facts = read_exif(path) if is_photo(path) else PhotoFacts()
    known = calibration(raw.size, intrinsics, hfov_deg)
    if not known.known and not known.hfov:
        known = _by_exif(known, facts, raw.size)
    notes += _place(facts)
    sizing = cover(raw.size, size)
    camera = sizing.camera(known.camera)
    if known.distortion is None:
        rgb = sizing.apply(raw.rgb)
    else:
        rgb = Undistorter.create(SourceLens(known.distortion, camera), known.camera, sizing).apply(raw.rgb)
    cut = 1 - min(sizing.target[axis] / sizing.scaled[axis] for axis in (0, 1))
    if cut > _WORTH_A_NOTE:
        notes.append(f"{100 * cut:.0f} % of the photo was cut away to fit the model's {size[0]}x{size[1]}.")
    if sizing.shrink < 1:
        notes.append(f"The photo was enlarged {1 / sizing.shrink:.2f} times; it holds no more detail.")
    return Photo(rgb, camera, known.known, (*raw.notes, *known.notes, *notes), known.hfov)


def _out_of_panorama(
    path: Path, raw: RawFrame, size: tuple[int, int], view: tuple[float, float], hfov_deg: float
) -> Photo:
    rgb, camera = view_of(raw.rgb, *view, hfov_deg, size, str(path))
    heading, pitch = view
    said = (
        f"A view was taken out of the panorama {path.name}: heading {heading:g}, pitch {pitch:g}, field of "
        f"view {hfov_deg:g} degrees."
    )
    return Photo(rgb, camera, True, (*raw.notes, said, *_place(read_exif(path))))


def _by_exif(guess: Calibration, facts: PhotoFacts, size: tuple[int, int]) -> Calibration:
    """The guess with the focal length that the photo tells, if it does."""
    focal = facts.focal_px(size)
    if focal is None:
        return guess
    said = (
        f"The photo's EXIF data tell the focal length, {facts.focal_35_mm:g} mm on film of 36 x 24 mm.",
        *guess.notes[1:],
    )
    return replace(guess, camera=replace(guess.camera, fx_px=focal, fy_px=focal), hfov=True, notes=said)


def _place(facts: PhotoFacts) -> list[str]:
    if facts.latitude_deg is None or facts.longitude_deg is None:
        return []
    heading = "" if facts.heading_deg is None else f", heading {facts.heading_deg:.0f} degrees"
    where = f"{facts.latitude_deg:.5f}, {facts.longitude_deg:.5f}{heading}"
    return [f"The photo was taken at {where}, by its EXIF data."]


def is_photo(path: Path) -> bool:
    """Whether it is a file of one picture, not a recording."""
    return path.is_file() and path.suffix.lower() in SUFFIXES


def leading_frames(path: Path, count: int, rate_hz: float = 1.0) -> tuple[list[RawFrame], list[str]]:
    """A photo; or at most ``count`` first frames of a recording, of a video those nearest to a model's times.

    A folder's rate counts as that of the model. With them come sentences for the report.
    """
    if not path.exists():
        raise InputError(f"{path} does not exist; expected a photo, or a video or folder of leading frames")
    if is_photo(path):
        return [read_image(path)], []
    source = open_source(path)
    if isinstance(source, Video):
        frames, notes = _nearest(source, count, rate_hz)
        return frames, [*notes, *of_damage([frame.index for frame in frames if frame.damaged])]
    return list(source.read(range(min(count, source.count())))), []


def _nearest(video: Video, count: int, rate_hz: float) -> tuple[list[RawFrame], list[str]]:
    """The frames nearest to whole numbers of steps, up to the first step that has none of its own near it."""
    found: list[tuple[float, RawFrame]] = []
    for frame in video.read(range(UNBOUNDED)):
        time_s = frame.index / (video.rate_hz or rate_hz) if frame.time_s is None else frame.time_s
        misses = [abs(time_s * rate_hz - step) for step in range(count)]
        found = [
            (miss, frame) if not found or miss < found[step][0] - _ROUNDING else found[step]
            for step, miss in enumerate(misses)
        ]
        if time_s >= (count - 1) / rate_hz:
            break
    taken = found[:1]
    for miss, frame in found[1:]:
        if miss > _HALF_STEP or frame.index == taken[-1][1].index:
            break
        taken.append((miss, frame))
    frames, worst = [frame for _, frame in taken], max(miss for miss, _ in taken)
    notes: list[str] = []
    if worst > _WORTH_A_NOTE:
        off = f"up to {worst:.0%} of a step off the model's {rate_hz:g} Hz"
        notes.append(f"The leading frames are {off}: the video has none at its times.")
    if len(taken) < count:
        notes.append(
            f"Only {len(taken)} of {count} leading frames at {rate_hz:g} Hz are in {video.path.name}."
        )
    return frames, notes
