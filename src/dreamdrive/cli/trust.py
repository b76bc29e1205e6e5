"""What ``render`` says of how far its drives can be believed."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dreamdrive.drive import Drive
    from dreamdrive.scene.scene import Scene
    from dreamdrive.trust import SceneTrust

_ASIDE_M = 0.25
"""Drives nearer to the recorded one are hardly worse."""
_BESIDE_M = 2.0


def trust_of(scene: "Scene", drives: Sequence["Drive"], needed: bool) -> "SceneTrust | None":
    """Of a scene, where it is needed, or where a drive leaves the recorded one; None else.

    Raises:
        InputError: It is needed, and the scene does not know how far it is off its frames.
    """
    from dreamdrive.drive import distance_m, smooth
    from dreamdrive.trust import SceneTrust

    recorded = smooth(scene.trajectory)
    aside = scene.residual is not None and any(distance_m(each.path, recorded) > _ASIDE_M for each in drives)
    return SceneTrust.of(scene) if needed or aside else None


def bent(drive: "Drive", trust: "SceneTrust") -> "Drive":
    """A drive that stays where the scene can be believed."""
    from dreamdrive.drive import smooth
    from dreamdrive.trust import within_trust

    return replace(drive, path=within_trust(trust, drive.path, smooth(trust.scene.trajectory)))


def believed(trust: "SceneTrust") -> str:
    """What to expect on the recorded drive and beside it, and where that is no longer good."""
    from dreamdrive.trust import FALL_DB, SHIFTS_M, expected_db, reach_m

    expected = cache(partial(expected_db, trust))
    path_db, beside_db = expected(0.0), min(expected(-_BESIDE_M), expected(_BESIDE_M))
    ends = {word: reach_m(expected, side) for word, side in (("left", -1), ("right", 1))}
    words = " and from ".join(f"{_from(metres, SHIFTS_M[-1])} to the {word}" for word, metres in ends.items())
    return (
        f"PSNR to expect: {path_db:.1f} dB on the recorded drive, {beside_db:.1f} dB {_BESIDE_M:g} m aside; "
        f"{FALL_DB:g} dB less from {words} on"
    )


def _from(metres: float, most_m: float) -> str:
    return f"{most_m:g} m or more" if metres >= most_m else f"{metres:.2g} m"
