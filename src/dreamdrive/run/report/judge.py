"""Judgement of a run, in sentences for somebody who has never seen one."""

import numpy as np

from dreamdrive.run.report.facts import Facts
from dreamdrive.scene.geometry import CREEP_M
from dreamdrive.scene.scene import Scene

ENOUGH_FRAMES = 8
"""Fewer frames with a place on the path show too little of a street."""
SLOW_S = 0.35
"""Frames further apart in time share too little of the street to be followed."""
ASIDE_M = 2
"""As far beside the recorded path views hold best, where several frames showed the street."""
ASIDE_OF_PHOTO_M = 1
"""The same of one photo: further aside most of what is seen is made up."""
FASTEST_KM_H = 150
"""Nobody films a street at a higher mean speed."""
STANDS_M = 2
"""As far the path of a camera that stands may wander: positioning systems are off by metres."""
MANY = 4
"""So many times as much found as was set in motion is too much; a lorry in three parts is not."""
FOUND = 0.5
"""Share of what was set in motion that has to be found, and of what was found that was set in motion."""
_KM_H = 3.6
_USUAL, _SHORT = 480, 12  # pixels, frames: of a village 8 % were found at 240 px and 69 % at 480
_SURE = "given", "height", "seen sizes", "usual height"
_SURE_SPREAD = 0.2
_SHORTER = "a shorter stretch, chosen with --frames, is easier"
_BETTER: dict[str, str] = {
    "draft": "--quality standard takes more steps",
    "standard": "--quality high takes more steps",
    "high": _SHORTER,
}
_HEIGHT, _VIEW = "--camera-height", "--hfov or --intrinsics"


def remarks_of(scene: Scene) -> tuple[str, ...]:
    """What else to know of a scene, a sentence each."""
    return tuple(remark for remark in (per_frame(scene), untracked(scene)) if remark is not None)


def untracked(scene: Scene) -> str | None:
    """What to know of what moves and belongs to no actor; None where there is nothing."""
    if scene.dynamic.actor is None:
        return None
    count = int((scene.dynamic.actor < 0).sum())
    if not count:
        return None
    return (
        f"{count:,} Gaussians of what moves could not be followed from frame to frame: they are shown only "
        "near the frames that saw them."
    )


def per_frame(scene: Scene) -> str | None:
    """What to know of a per-frame street; None of one that stands."""
    if not scene.moves_per_frame:
        return None
    return (
        "The frames do not show well enough how the camera drove: the street is kept as single frames, which "
        "move as the picture does. The recorded drive is shown well, other views show what one frame saw."
    )


def rough_because(facts: Facts) -> tuple[str, ...]:
    """Why the result is rough, and what helps, a sentence each; nothing where it is not."""
    of = _of_few, _of_fallback, _of_cuts, _of_motion, _of_scale, _of_speed, _of_traffic, _of_held_out
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


def _of_speed(facts: Facts) -> str | None:
    if facts.against or not facts.seconds:
        return None
    if _wanders(facts):
        return (
            f"the frames show a camera that stands, and by the poses that were given it went "
            f"{facts.length_m:.0f} m. Choose frames in which the car drives, with --frames, or leave out the "
            "poses"
        )
    if _speed_km_h(facts) <= FASTEST_KM_H:
        return None
    return (
        f"the car drives {_speed_km_h(facts):.0f} km/h, which no street allows: times or metres are wrong. "
        f"Give the rate of the frames with --fps, or what metres rest on with {_HEIGHT} or --poses"
    )


def _wanders(facts: Facts) -> bool:
    """Whether a camera that stands goes somewhere by the poses that were given."""
    return facts.moves is False and facts.basis == "given" and facts.length_m > STANDS_M


def _of_traffic(facts: Facts) -> str | None:
    traffic = facts.traffic
    if traffic is None:
        return None
    larger = [f"larger frames, such as --size {_USUAL}x270"] if facts.width < _USUAL else []
    set_off = f"{_things(traffic.things)} set in motion in the photo, and {_things(traffic.found)} found"
    if traffic.recall is not None and traffic.recall < FOUND:
        helps = *larger, "--traffic still, which leaves all in place"
        return (
            f"what moves was not found again: {set_off}, which cover {traffic.recall:.0%} of what moved; the "
            f"rest is smeared over the street. What helps is {' or '.join(helps)}"
        )
    wrong = traffic.precision is None or traffic.precision < FOUND
    if traffic.found > traffic.things and (wrong or traffic.found > MANY * traffic.things):
        shorter = [f"a shorter drive, such as --frames 0:{_SHORT}"] if facts.frames > _SHORT else []
        helps = *larger, *shorter, "render --without ID, which leaves one out"
        return (
            f"more was found to move than does: {set_off}; the others are pieces of the street. What helps "
            f"is {' or '.join(helps)}"
        )
    return None


def _things(count: int) -> str:
    return {0: "nothing was", 1: "1 thing was"}.get(count, f"{count} things were")


def _speed_km_h(facts: Facts) -> float:
    return _KM_H * facts.length_m / facts.seconds if facts.seconds else 0.0


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


def limits_of(facts: Facts) -> tuple[str, str, str]:
    """How sure metres are, how far aside a view may be, how far and fast the car goes, a sentence each."""
    return _metres(facts), _aside(facts), _drive(facts)


def aside_m(facts: Facts) -> float:
    """As far beside the path views can be trusted; 0 where none can."""
    guessed = facts.fallback is not None or len(facts.scenes) > 1 or _wanders(facts)
    if guessed or facts.all_moves or facts.moves_per_frame:
        return 0.0
    return ASIDE_OF_PHOTO_M if facts.drawn else ASIDE_M


def _drive(facts: Facts) -> str:
    if not facts.seconds:
        return "the frames are of one moment"
    if facts.length_m < CREEP_M:
        return f"the camera stands for {facts.seconds:.1f} s"
    said = f"{facts.length_m:.0f} m in {facts.seconds:.1f} s, {_speed_km_h(facts):.0f} km/h in the mean"
    if facts.fallback is not None or _wanders(facts):
        return f"{said}: a guess, as the path is one"
    sure = facts.basis in _SURE and not facts.against and facts.spread <= _SURE_SPREAD
    return said if sure else f"{said}: as uncertain as the metres"


def _metres(facts: Facts) -> str:
    if facts.basis == "given":
        if facts.against:
            return f"as given with the input, which cannot be right: {facts.against}"
        return "as given with the input" + ("" if facts.spread == 0 else f", within {_percent(facts)}")
    if facts.basis == "asked path":
        return "those of the path that was asked for; a model drew the frames, and may not have kept to it"
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
        sure = f", within {_percent(facts)}" if facts.spread else ""
        return f"from the height of the camera{sure}"
    return f"they may be off by {_percent(facts)}, since {' and '.join(assumed)}. Give {' and '.join(give)}"


def _assumed(facts: Facts) -> tuple[list[str], list[str]]:
    assumed: list[str] = []
    give: list[str] = []
    if facts.basis == "usual height":
        assumed.append("the camera is taken to be 1.5 m above the road")
    if facts.basis == "seen sizes":
        assumed.append(f"they rest on a {facts.source}")
    if assumed:
        give.append(_HEIGHT)
    if not facts.focal_observed:
        whose = "its" if facts.basis == "usual height" else "the camera's"
        assumed.append(f"{whose} field of view is a guess")
        give.append(_VIEW)
    return assumed, give


def _percent(facts: Facts) -> str:
    return f"{100 * facts.spread:.0f} %" if np.isfinite(facts.spread) else "any factor"


def _aside(facts: Facts) -> str:
    if facts.all_moves:
        return "views beside the recorded path cannot be trusted here, since nothing stands"
    if facts.fallback is not None or len(facts.scenes) > 1 or _wanders(facts):
        return "views beside the recorded path cannot be trusted here, since distances are a guess"
    if facts.moves_per_frame:
        return "views beside the recorded path show only what one frame saw, with gaps"
    if facts.drawn:
        return (
            f"views up to {ASIDE_OF_PHOTO_M} m beside the path hold best; further away, and behind what the "
            "photo shows, all is made up"
        )
    return f"views up to {ASIDE_M} m beside the recorded path hold best; further away gaps show"
