"""Facts that the judgement of a run rests on."""

from dataclasses import dataclass

import numpy as np

from dreamdrive.run.report.held_out import Likeness
from dreamdrive.run.report.in_motion import FoundTraffic
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Basis, Fallback, Geometry

EVERYTHING = 0.95
"""Share of the pixels that count as moving from which on all do: some are always taken wrongly."""
STEPS_OF_STANDING = 0.15
"""Share of the steps that may look as if the camera moved while it stands: traffic passes by."""


@dataclass(frozen=True)
class Facts:
    """What the judgement rests on, of one camera.

    ``placed`` frames found their place on the path; ``scenes`` are first and last index in the source of each
    piece between two cuts, where frames are ``step`` apart. Likeness is the mean of the held-out frames in
    decibels, and that of blending their neighbours along the motion in the picture. ``basis`` is what metres
    rest on, ``spread`` how far they may be off, as a fraction. ``all_moves`` where nothing is known to stand,
    ``moves_per_frame`` where the street moves as the picture does. ``against`` says why metres that were
    given cannot be right, ``source`` what they rest on in words. The path of ``length_m`` took ``seconds``;
    ``moves`` says whether the frames show a camera that moves, None where that is not known. ``drawn`` frames
    show what one photo does, ``width`` pixels wide, and ``traffic`` is what was set in motion in it.
    """

    frames: int
    placed: int
    interval_s: float
    fallback: Fallback | None
    scenes: tuple[tuple[int, int], ...]
    step: int
    psnr: float | None
    blended_psnr: float | None
    quality: str
    focal_observed: bool
    basis: Basis
    spread: float
    all_moves: bool = False
    moves_per_frame: bool = False
    against: str = ""
    length_m: float = 0.0
    seconds: float = 0.0
    moves: bool | None = None
    drawn: bool = False
    source: str = ""
    width: int = 480
    traffic: FoundTraffic | None = None


def facts_of(
    clip: Clip,
    geometry: Geometry,
    quality: str,
    held_out: dict[int, Likeness],
    blended: dict[int, Likeness],
    *,
    none_stands: bool = False,
    moves_per_frame: bool = False,
    traffic: FoundTraffic | None = None,
) -> Facts:
    """What there is to say of a result, of its first camera; ``blended`` is of blending the neighbours.

    ``none_stands`` says that a scene which tells static from moving has no static Gaussian,
    ``moves_per_frame`` that its street is one of single frames.
    """
    lead = clip.of_camera(int(clip.camera[0]))
    source, times_s = clip.source_index[lead], clip.times_s[lead]
    places_m = np.stack([geometry.cameras[i].world_from_camera[:3, 3] for i in lead])
    kind = geometry.fallback_kind or (None if geometry.fallback is None else "refused")
    return Facts(
        frames=len(lead),
        placed=len(lead) if geometry.placed is None else geometry.placed,
        interval_s=float(np.median(np.diff(times_s))) if len(lead) > 1 else 0.0,
        fallback=kind,
        scenes=_scenes(source, [int(np.searchsorted(lead, cut)) for cut in clip.cuts]),
        step=int(np.median(np.diff(source))) if len(lead) > 1 else 1,
        psnr=_mean_psnr(held_out),
        blended_psnr=_mean_psnr(blended),
        quality=quality,
        focal_observed=geometry.focal.observed,
        basis=geometry.scale.basis,
        spread=geometry.scale.spread,
        all_moves=none_stands or _moving_share(clip, geometry, lead) >= EVERYTHING,
        moves_per_frame=moves_per_frame,
        against=geometry.scale.against,
        length_m=float(np.linalg.norm(np.diff(places_m, axis=0), axis=1).sum()),
        seconds=float(times_s[-1] - times_s[0]),
        moves=_moves(geometry, len(lead)),
        drawn=clip.known.drawn,
        source=geometry.scale.source,
        width=clip.size[0],
        traffic=traffic,
    )


def _moves(geometry: Geometry, frames: int) -> bool | None:
    """Whether the frames show a camera that moves, which steps they were told to."""
    steps = geometry.details.get("moving_steps")
    return None if steps is None else steps > STEPS_OF_STANDING * frames


def _moving_share(clip: Clip, geometry: Geometry, lead: np.ndarray) -> float:
    """Share of the pixels with depth that count as moving, over the frames that may be seen."""
    seen = lead[~clip.held_out[lead]]
    solid = geometry.depth_m[seen] > 0
    return float((geometry.moving[seen][solid] >= 0.5).mean()) if solid.any() else 0.0


def _scenes(source: np.ndarray, cuts: list[int]) -> tuple[tuple[int, int], ...]:
    pieces = [piece for piece in np.split(source, sorted(set(cuts))) if len(piece)]
    return tuple((int(piece[0]), int(piece[-1])) for piece in pieces)


def _mean_psnr(scores: dict[int, Likeness]) -> float | None:
    return float(np.mean([one.psnr for one in scores.values()])) if scores else None
