"""What a run will cost in time and memory, told before the work."""

from dataclasses import dataclass, replace
from math import ceil, sqrt

import numpy as np

from dreamdrive.choices import DATASETS
from dreamdrive.data import log_of
from dreamdrive.data.logs import choose_shots, samplers_of
from dreamdrive.data.sampler import MAX_FRAMES
from dreamdrive.data.select import Selection
from dreamdrive.data.size import MIN_SIDE_PX, choose_size
from dreamdrive.data.source import open_source
from dreamdrive.data.video import Video
from dreamdrive.errors import InputError
from dreamdrive.motion import REPRESENTATIONS
from dreamdrive.options import Options
from dreamdrive.prior import FRAMES, RATE_HZ, SIZE, read_street, wanted_frames
from dreamdrive.run.judge import ENOUGH_FRAMES
from dreamdrive.run.outcome import duration
from dreamdrive.scene.control import Control
from dreamdrive.scene.log import Log


class _Measured:
    """Seconds of one core and bytes, of six runs on one core of an Intel Xeon (AVX-512), 2026-11-25.

    Runs of PandaSet 002 with 12 to 60 frames of 320x180 and 480x270, as draft and standard. These figures
    meet the seconds within 20 % and the memory within 15 %. What they say of longer clips is their growth
    alone. Gaussians, and with them the time of a step, grow more slowly than the frames, which see the same
    street.
    """

    start: float = 1.0
    frame: float = 0.37
    frame_megapixel: float = 4.5
    frame_growth: float = 0.15
    step: float = 0.005
    step_megapixel: float = 0.58
    step_growth: float = 0.5
    score_megapixel: float = 0.7
    video: float = 0.04
    video_megapixel: float = 4.9
    usual_frames: float = 24.0
    serial: float = 1 / 3
    base_bytes: float = 640e6
    pixel_bytes: float = 200.0


LONG = 60
"""Frames from which on a clip is called long."""
_SHORT, _LEAST_HZ = 48, 8.0


@dataclass(frozen=True)
class Planned:
    """What a run will work on: frames of each camera, from ``start`` in the source on, ``step`` apart.

    The rate is that of the source, None where it is not known; ``chosen`` tells that somebody chose the
    frames.
    """

    frames: int
    cameras: int
    size: tuple[int, int]
    rate_hz: float | None
    start: int
    step: int
    chosen: bool

    @property
    def megapixels(self) -> float:
        """Of one frame."""
        return self.size[0] * self.size[1] / 1e6


def plan(control: Control, prior: str) -> Planned | None:
    """What a run will work on, as far as its input tells before it is read; None where that is unknown."""
    selection = Selection.parse(control.frames)
    if prior == "street-world":
        return _of_street(control)
    if prior != "replay" or control.path is None or DATASETS.package(control.dataset):
        return None
    log = log_of(control)
    return _of_recording(control, selection) if log is None else _of_log(control, log)


def _of_street(control: Control) -> Planned:
    street = None if control.path is None else read_street(control, control.path)
    rows = wanted_frames(control, FRAMES, RATE_HZ if control.fps is None else control.fps, street)
    cameras = () if street is None else street.cameras
    size = samplers_of(cameras, control.size)[0].sizing.target if cameras else control.size or SIZE
    return Planned(len(rows), max(1, len(cameras)), size, None, rows.start, rows.step, True)


def _of_log(control: Control, log: Log) -> Planned:
    shots = choose_shots(log, control.cameras, control.frames)
    lead = shots[0].camera
    rows = shots[0].rows
    size = choose_size((lead.pinhole.width_px, lead.pinhole.height_px), control.size).target
    rate_hz = 1 / float(np.median(np.diff(lead.times_s)))
    step = int(rows[1] - rows[0])
    return Planned(len(rows), len(shots), size, rate_hz, int(rows[0]), step, control.frames is not None)


def _of_recording(control: Control, selection: Selection) -> Planned | None:
    from dreamdrive.data.rig import is_rig, read_rig

    assert control.path is not None
    rig = read_rig(control.path) if is_rig(control.path) else ()
    source = open_source(rig[0].frames if rig else control.path)
    claimed = source.claimed_count() if isinstance(source, Video) else source.count()
    if claimed is None:
        return None
    wanted = range(claimed)[selection.start : selection.stop : selection.step]
    if not 0 < len(wanted) <= MAX_FRAMES:
        return None  # whoever reads the frames says what is wrong, or that the file claims too much
    first = next(iter(source.read(range(1))))
    size = choose_size(first.size, control.size).target
    chosen = control.frames is not None
    rate_hz = control.fps or (source.rate_hz if isinstance(source, Video) else None)
    return Planned(len(wanted), max(1, len(rig)), size, rate_hz, wanted.start, wanted.step, chosen)


def seconds_of(planned: Planned, options: Options, cores: int) -> float:
    """About how long a run takes, with geometry found from the frames alone."""
    m = _Measured
    frames, pixels = planned.frames * planned.cameras, planned.megapixels
    more = frames / m.usual_frames
    geometry = frames * (m.frame + m.frame_megapixel * pixels) * more**m.frame_growth
    step = m.step + m.step_megapixel * pixels * more**m.step_growth
    o = options.for_frames(frames)
    fits = step * (o.static.steps + o.fit.steps * REPRESENTATIONS[o.representation].step)
    videos = frames * (m.video + m.video_megapixel * pixels)
    work = m.start + geometry + fits + m.score_megapixel * frames * pixels + videos
    return work * (m.serial + (1 - m.serial) / max(1, cores))


def bytes_of(planned: Planned) -> float:
    """About how much memory a run takes at its peak."""
    pixels = planned.frames * planned.cameras * planned.megapixels * 1e6
    return _Measured.base_bytes + _Measured.pixel_bytes * pixels


def check_memory(planned: Planned, free: int | None) -> None:
    """Refuse what ``free`` bytes cannot hold, before it is read; None where the system does not tell."""
    needed = bytes_of(planned)
    if free is None or needed <= free:
        return
    (width, height), room = planned.size, max(0.0, free - _Measured.base_bytes)
    share = room / (needed - _Measured.base_bytes)
    advice: list[str] = []
    if (fitting := int(planned.frames * share)) >= ENOUGH_FRAMES:
        advice.append(_frames(planned.start, fitting, planned.step))
    small = tuple(2 * int(side * sqrt(share) / 2) for side in (width, height))
    if min(small) >= 4 * MIN_SIDE_PX:
        advice.append(f"--size {small[0]}x{2 * round(small[0] * height / width / 2)}")
    words = f"give {' or '.join(advice)}" if advice else "free some memory, or give a smaller --size"
    raise InputError(
        f"{_what(planned)} need about {needed / 1e9:.1f} GB of memory, and {free / 1e9:.1f} GB are free; "
        f"{words}"
    )


def announcement(planned: Planned, options: Options, cores: int) -> tuple[str, ...]:
    """What a run will cost, and for a long clip that nobody shortened what would cost less."""

    def time_of(one: Planned) -> str:
        return duration(_rounded(seconds_of(one, options, cores)))

    on = "1 core" if cores == 1 else f"{cores} cores"
    memory = f"{bytes_of(planned) / 1e9:.1f} GB"
    said = (f"{_what(planned)} take about {time_of(planned)} on {on}, and {memory} of memory",)
    if planned.chosen or planned.frames <= LONG:
        return said
    step = min(ceil(planned.frames / _SHORT), max(1, int((planned.rate_hz or _LEAST_HZ) / _LEAST_HZ)))
    short = replace(planned, frames=min(_SHORT, ceil(planned.frames / step)))
    return (
        *said,
        f"That is a long clip: {_frames(0, short.frames, step)} takes {short.frames} of its frames, in about "
        f"{time_of(short)}",
    )


def _what(planned: Planned) -> str:
    width, height = planned.size
    of = "" if planned.cameras == 1 else f" of each of {planned.cameras} cameras"
    return f"{planned.frames} frames{of} at {width}x{height}"


def _frames(start: int, count: int, step: int) -> str:
    stop = start + (count - 1) * step + 1
    return f"--frames {start}:{stop}" + (f":{step}" if step > 1 else "")


def _rounded(seconds: float) -> float:
    """As precise as it deserves: to 5 s, half a minute or a minute."""
    to = 5 if seconds < 60 else 30 if seconds < 300 else 60
    return max(to, to * round(seconds / to))
