"""How well a run went, in sentences for somebody who has never seen one."""

from dataclasses import dataclass

import numpy as np

from dreamdrive.run.held_out import Likeness
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Basis, Fallback, Geometry
from dreamdrive.scene.scene import Scene

ENOUGH_FRAMES = 8
"""Fewer frames with a place on the path show too little of a street."""
SLOW_S = 0.35
"""Frames further apart in time share too little of the street to be followed."""
ASIDE_M = 2
"""As far beside the recorded path a view is drawn by every run."""
EVERYTHING = 0.95
"""Share of the pixels that count as moving from which on all do: some are always taken wrongly."""

_SHORTER = "a shorter stretch, chosen with --frames, is easier"
_BETTER: dict[str, str] = {
    "draft": "--quality standard takes more steps",
    "standard": "--quality high takes more steps",
    "high": _SHORTER,
}
_HEIGHT, _VIEW = "--camera-height", "--hfov or --intrinsics"


@dataclass(frozen=True)
class Facts:
    """What the judgement rests on, of one camera.

    ``placed`` frames found their place on the path; ``scenes`` are first and last index in the source of each
    piece between two cuts, where frames are ``step`` apart. Likeness is the mean of the held-out frames in
    decibels, and that of blending their neighbours along the motion in the picture. ``basis`` is what metres
    rest on, ``spread`` how far they may be off, as a fraction. ``all_moves`` where nothing is known to stand,
    ``drifts`` where the street moves as the picture does. ``against`` says why metres that were given cannot
    be right.
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
    drifts: bool = False
    against: str = ""


def facts_of(
    clip: Clip,
    geometry: Geometry,
    quality: str,
    held_out: dict[int, Likeness],
    blended: dict[int, Likeness],
    *,
    none_stands: bool = False,
    drifts: bool = False,
) -> Facts:
    """What there is to say of a result, of its first camera; ``blended`` is of blending the neighbours.

    ``none_stands`` says that a scene which tells static from moving has no static Gaussian, ``drifts`` that
    its street is one of single frames.
    """
    lead = clip.of_camera(int(clip.camera[0]))
    source, times_s = clip.source_index[lead], clip.times_s[lead]
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
        drifts=drifts,
        against=geometry.scale.against,
    )


def _moving_share(clip: Clip, geometry: Geometry, lead: np.ndarray) -> float:
    """Share of the pixels with depth that count as moving, over the frames that may be seen."""
    seen = lead[~clip.held_out[lead]]
    solid = geometry.depth_m[seen] > 0
    return float((geometry.moving[seen][solid] >= 0.5).mean()) if solid.any() else 0.0


def remarks_of(scene: Scene) -> tuple[str, ...]:
    """What else to know of a scene, a sentence each."""
    return tuple(remark for remark in (drifting(scene), untracked(scene)) if remark is not None)


def untracked(scene: Scene) -> str | None:
    """What to know of what moves and belongs to no actor; None where there is nothing."""
    if scene.dynamic.actor is None:
        return None
    count = int((scene.dynamic.actor < 0).sum())
    if not count:
        return None
    return (
        f"{count:,} Gaussians of what moves have no track, as too few frames saw it, or none that is likely: "
        "they show beside the frames that saw them alone."
    )


def drifting(scene: Scene) -> str | None:
    """What to know of a street that drifts; None of one that stands."""
    if not scene.drifts:
        return None
    return (
        "No path of the camera explains what stands as well as the frames beside each frame do: the street "
        "is made of single frames, which move as the picture does."
    )


def _scenes(source: np.ndarray, cuts: list[int]) -> tuple[tuple[int, int], ...]:
    pieces = [piece for piece in np.split(source, sorted(set(cuts))) if len(piece)]
    return tuple((int(piece[0]), int(piece[-1])) for piece in pieces)


def _mean_psnr(scores: dict[int, Likeness]) -> float | None:
    return float(np.mean([one.psnr for one in scores.values()])) if scores else None


def rough_because(facts: Facts) -> tuple[str, ...]:
    """Why the result is rough, and what helps, a sentence each; nothing where it is not."""
    of = _of_few, _of_fallback, _of_cuts, _of_motion, _of_scale, _of_held_out
    reasons = [each(facts) for each in of]
    return tuple(reason for reason in reasons if reason is not None)


def _of_fallback(facts: Facts) -> str | None:
    if facts.fallback is None or facts.fallback == "few":
        return None  # too few frames have a sentence of their own
    if facts.fallback == "blank":
        return (
            "nothing in the frames could be followed from one to the next: they are too dark, too plain or "
            "too noisy. The camera counts as standing still. Choose clearer frames with --frames"
        )
    if facts.fallback == "standing":
        return (
            "the camera stands still, which hides how far away things are. Choose frames in which the car "
            "drives, with --frames"
        )
    if facts.interval_s > SLOW_S:
        return (
            f"the frames are {facts.interval_s:.1f} s apart, too far to tell how the camera moved; its path "
            "is a guess. Give a recording with five frames a second or more, or a smaller step in --frames"
        )
    return (
        "the frames did not show clearly how the camera moved; its path is a guess. Choose frames in which "
        "the car drives along a street that is well seen, with --frames, or give the path with --poses"
    )


def _of_cuts(facts: Facts) -> str | None:
    if len(facts.scenes) < 2:
        return None
    first, last = max(facts.scenes, key=lambda scene: scene[1] - scene[0])
    starts = [str(scene[0]) for scene in facts.scenes[1:]]
    where = f"frame {starts[0]}" if len(starts) == 1 else f"frames {', '.join(starts[:3])}"
    step = f":{facts.step}" if facts.step > 1 else ""
    return (
        f"the recording jumps to another place at {where}, and one scene was made of all. Choose one place, "
        f"such as --frames {first}:{last + 1}{step}"
    )


def _of_motion(facts: Facts) -> str | None:
    if not facts.all_moves:
        return None
    return (
        "everything in the clip counts as moving: no street is left that stands, and views from "
        "elsewhere have nothing to rest on. Choose frames that show more of the street, with --frames"
    )


def _of_scale(facts: Facts) -> str | None:
    if not facts.against:
        return None
    return (
        f"by the poses that were given {facts.against}: their unit is no metre, or they are not of these "
        "frames. Bring their positions to metres, or leave them out"
    )


def _of_few(facts: Facts) -> str | None:
    if facts.frames < ENOUGH_FRAMES:
        return (
            f"there are only {facts.frames} frames. Give {ENOUGH_FRAMES} or more, better 24, with --frames "
            "or a longer recording"
        )
    if facts.placed < ENOUGH_FRAMES:
        return (
            f"only {facts.placed} of {facts.frames} frames found their place on the path. Choose frames in "
            "which the street is well seen, with --frames"
        )
    return None


def _of_held_out(facts: Facts) -> str | None:
    if facts.psnr is None or facts.blended_psnr is None or facts.psnr >= facts.blended_psnr:
        return None
    return (
        "held-out frames are predicted worse than by blending the frames beside them "
        f"({_apart(facts.psnr, facts.blended_psnr)} dB): {_BETTER.get(facts.quality, _SHORTER)}"
    )


def _apart(first: float, second: float) -> str:
    """Two figures, with as many digits as it takes to tell them apart, two at most."""
    digits = 2 if f"{first:.1f}" == f"{second:.1f}" else 1
    return f"{first:.{digits}f} against {second:.{digits}f}"


def limits_of(facts: Facts) -> tuple[str, str]:
    """How sure metres are, and how far aside a view may be, a sentence each."""
    return _metres(facts), _aside(facts)


def _metres(facts: Facts) -> str:
    if facts.basis == "given":
        if facts.against:
            return f"as given with the input, which cannot be right: {facts.against}"
        return "as given with the input" + ("" if facts.spread == 0 else f", within {_percent(facts)}")
    if facts.basis in ("usual speed", "usual depth"):
        what = "a speed of 8 m/s" if facts.basis == "usual speed" else "a distance of 12 m"
        return (
            f"nothing shows them; {what} is assumed, so that all distances may be off by {_percent(facts)} "
            "or more. Frames in which the road is well seen help, and --poses"
        )
    if facts.basis == "asked speed":
        return f"from the speed that was asked for; they may be off by {_percent(facts)}"
    assumed, give = _assumed(facts)
    if not assumed:
        return f"from the height of the camera, within {_percent(facts)}"
    return f"they may be off by {_percent(facts)}, since {' and '.join(assumed)}. Give {' and '.join(give)}"


def _assumed(facts: Facts) -> tuple[list[str], list[str]]:
    assumed: list[str] = []
    give: list[str] = []
    if facts.basis == "usual height":
        assumed.append("the camera is taken to be 1.5 m above the road")
        give.append(_HEIGHT)
    if not facts.focal_observed:
        whose = "its" if assumed else "the camera's"
        assumed.append(f"{whose} field of view is a guess")
        give.append(_VIEW)
    return assumed, give


def _percent(facts: Facts) -> str:
    return f"{100 * facts.spread:.0f} %" if np.isfinite(facts.spread) else "any factor"


def _aside(facts: Facts) -> str:
    if facts.all_moves:
        return "views beside the recorded path cannot be trusted here, since nothing stands"
    if facts.fallback is not None or len(facts.scenes) > 1:
        return "views beside the recorded path cannot be trusted here, since distances are a guess"
    if facts.drifts:
        return "views beside the recorded path show what single frames saw, and gaps between"
    return f"views up to {ASIDE_M} m beside the recorded path hold best; further away gaps show"
