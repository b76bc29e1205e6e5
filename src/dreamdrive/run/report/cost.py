"""Estimates of a run's time and memory, told before the work."""

from dataclasses import replace
from math import ceil, sqrt

from dreamdrive.data.frames.select import of_thinning
from dreamdrive.data.planned import Planned
from dreamdrive.errors import InputError
from dreamdrive.fit import FitSize, SeedOptions, plan_fit
from dreamdrive.motion import REPRESENTATIONS
from dreamdrive.options import Options
from dreamdrive.run.report.judge import ENOUGH_FRAMES
from dreamdrive.run.report.outcome import duration
from dreamdrive.scene.control import MIN_SIDE_PX


class _Measured:
    """Seconds of one core and bytes, of six runs on one core of an Intel Xeon (AVX-512), 2026-11-25.

    Runs of PandaSet 002 with 12 to 60 frames of 320x180 and 480x270, as draft and standard. These figures
    meet the seconds within 20 % and the memory within 15 %. What they say of longer clips is their growth
    alone. Gaussians, and with them the time of a step, grow more slowly than the frames, which see the same
    street. Of 24 frames at least 0.05 of the pixels became Gaussians, on other drives up to 0.11, of which
    0.02 to 0.15 move.
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
    seeds: float = 0.05
    moving: float = 0.02
    base_bytes: float = 640e6
    pixel_bytes: float = 200.0


LONG = 60
"""Frames from which on a clip is called long."""
_SHORT, _LEAST_HZ = 48, 8.0


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


def fit_of(planned: Planned, options: Options) -> FitSize:
    """The least that the fits of a run can be expected to be; seeds are denser with a smaller stride."""
    m, o = _Measured, options
    more = (planned.frames / m.usual_frames) ** m.step_growth
    pixels = m.usual_frames * more * planned.cameras * planned.megapixels * 1e6
    count = int(m.seeds * pixels * (SeedOptions().stride_px / o.seeds.stride_px) ** 2)
    moves = {"none": 0.0, "scored": m.moving, "all": 1.0}[REPRESENTATIONS[o.representation].moves]
    return FitSize(
        gaussians=count,
        moving=int(moves * count),
        views=planned.frames * planned.cameras,
        size_px=planned.size,
        cameras=planned.cameras,
        coefficients=(o.seeds.sh_degree + 1) ** 2,
        motion=o.motion,
    )


def announcement_of_gpu(planned: Planned, options: Options) -> str:
    """What the fits of a run will take of a GPU at least."""
    size = fit_of(planned, options)
    count = float(f"{size.gaussians:.2g}")
    return (
        f"{_what(planned)} take at least {max(0.1, plan_fit(size).peak / 1e9):.1f} GB of the GPU, with about "
        f"{count:,.0f} Gaussians"
    )


def announcement(planned: Planned, options: Options, cores: int) -> tuple[str, ...]:
    """What a run will cost, and for a long clip that nobody shortened what would cost less."""

    def time_of(one: Planned) -> str:
        return duration(_rounded(seconds_of(one, options, cores)))

    on = "1 core" if cores == 1 else f"{cores} cores"
    memory = f"{bytes_of(planned) / 1e9:.1f} GB"
    thinned = of_thinning(1 if planned.chosen else planned.step)
    said = (
        *thinned,
        f"{_what(planned)} take about {time_of(planned)} on {on}, and {memory} of memory",
    )
    if planned.chosen or planned.frames <= LONG:
        return said
    of = planned.frames * planned.step
    step = min(ceil(of / _SHORT), max(1, int((planned.rate_hz or _LEAST_HZ) / _LEAST_HZ)))
    short = replace(planned, frames=min(_SHORT, ceil(of / step)))
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
