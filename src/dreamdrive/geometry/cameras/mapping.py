"""Structure from motion of a clip with its gate: an accepted model, or why there is none."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dreamdrive.files.output import temporary_folder
from dreamdrive.geometry.cameras import gate, sfm
from dreamdrive.geometry.cameras.focal import Settled, settle
from dreamdrive.geometry.cameras.sfm import SparseModel
from dreamdrive.geometry.depth import Tell, unheard
from dreamdrive.geometry.evidence import Evidence, Features, features, find_features, shows_little
from dreamdrive.geometry.options import GateOptions
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Fallback

MIN_FRAMES = 3
MIN_FEATURES = 60
STEPS = 3
"""Steps that are told of."""
ASIDE_DEG = 30.0
"""From which on a camera looks aside."""
STARTS = 6
"""Random starting positions of global mapping that are tried."""


@dataclass(frozen=True)
class MappingOutcome:
    """What structure from motion gave: an accepted model, or why and in what kind there is none.

    Notes are sentences on what else was noticed; figures those of the gate and the focal test, as JSON
    values. ``sure`` says that points are enough.
    """

    settled: Settled | None
    reasons: tuple[str, ...]
    notes: tuple[str, ...]
    figures: dict[str, Any]
    refusal: Fallback | None = None
    sure: bool = False


def reconstruct(
    clip: Clip, evidence: Evidence, options: GateOptions, seed: int, tell: Tell = unheard
) -> MappingOutcome:
    """Global mapping, focal test and gate; other mappings when the gate refuses; else the reasons.

    Where points are few, and where frames show little of the street from the start, the frames are looked at
    more closely. The model with the most points that the gate does not refuse is taken. ``tell`` is called
    after features, after matches, and with the model.
    """
    if len(clip) < MIN_FRAMES:
        return _refused(f"{len(clip)} frames are too few for structure from motion", "few")
    little = shows_little(clip, evidence)
    best: MappingOutcome | None = None
    for closer in (True,) if little else (False, True):
        found = find_features(clip, evidence, closer)
        typical = int(np.median([len(entry.keypoints_px) for entry in found]))
        if typical < MIN_FEATURES:
            outcome = _refused(f"the frames show too little: {typical} features in a typical one", "blank")
        else:
            outcome = _mapped(clip, evidence, found, options, seed, little=little, tell=tell)
        best = outcome if best is None or _points(outcome) > _points(best) else best
        if outcome.sure:
            break
    assert best is not None
    return best


def _points(outcome: MappingOutcome) -> int:
    return 0 if outcome.settled is None else len(outcome.settled.model.points)


def _mapped(
    clip: Clip,
    evidence: Evidence,
    found: list[Features],
    options: GateOptions,
    seed: int,
    *,
    little: bool,
    tell: Tell,
) -> MappingOutcome:
    """What comes of some features.

    Global mapping starts at random positions, and now and then ends in a folded path: other starts are tried
    before incremental mapping.
    """
    square, found = _square_pixels(evidence.working, found)
    notes: list[str] = []
    reasons: tuple[str, ...] = ()
    figures: dict[str, Any] = {"features": int(np.median([len(entry.keypoints_px) for entry in found]))}
    with temporary_folder() as folder:
        database = folder / "matches.db"
        tell()
        sfm.match(database, found, square, seed)
        tell()
        for name, again, start in _attempts(seed):
            mapper = sfm.map_globally if name == "global" else sfm.map_incrementally
            model = mapper(database, len(clip), start)
            if model is None or model.registered.mean() < 0.5:
                failed: tuple[str, ...] = (f"{name} mapping placed too few frames",)
            else:
                settled = settle(database, model, square, clip.known.intrinsics, seed)
                verdict = gate.judge(settled.model, evidence.motion.moving, options, little=little)
                failed = verdict.reasons
                figures |= verdict.figures | {"mapper": name, "focal_ladder": settled.ladder}
                if not failed:
                    tell()
                    notes += [settled.note] if settled.note else []
                    notes += _noticed(verdict, settled.model)
                    notes += [f"{reasons[0]}: mapped again, {again}"] if reasons else []
                    return MappingOutcome(settled, (), tuple(notes), figures, sure=verdict.few is None)
            reasons = reasons or failed
    return MappingOutcome(None, reasons, (), figures, "refused")


def _noticed(verdict: gate.GateVerdict, model: SparseModel) -> list[str]:
    """What is unusual about a drive, a sentence each."""
    notes = ["the camera drives backwards"] if verdict.backwards and verdict.aside_deg < ASIDE_DEG else []
    if verdict.aside_deg >= ASIDE_DEG:
        notes.append(f"the camera looks {verdict.aside_deg:.0f} degrees away from where it goes")
    if verdict.few is not None:
        notes.append(f"{verdict.few}: the path is as sure as these are")
    return notes + ([_wobbling(model)] if verdict.wobbling else [])


def _attempts(seed: int) -> list[tuple[str, str, int]]:
    """Mapper, how it differs from the first, in words, and its seed."""
    others = [("global", "from another start", (seed + k) % 2**31) for k in range(STARTS)]
    return [*others, ("incremental", "frame by frame", seed)]


def _refused(reason: str, refusal: Fallback) -> MappingOutcome:
    return MappingOutcome(None, (reason,), (), {}, refusal)


def _wobbling(model: SparseModel) -> str:
    return (
        f"points miss their pixels by {model.reprojection_px:.2f} px on average: the frames are not quite "
        "pictures of one street, and poses and depth are as exact as they are"
    )


def _square_pixels(camera: Camera, found: list[Features]) -> tuple[Camera, list[Features]]:
    """Stretch y so that both focal lengths agree: COLMAP's radial model has only one."""
    stretch = camera.fx_px / camera.fy_px
    height_px = max(1, round(camera.height_px * stretch))
    square = replace(camera, fy_px=camera.fx_px, cy_px=camera.cy_px * stretch, height_px=height_px)
    factor = np.array([1.0, stretch])
    return square, [features.scaled(entry, factor) for entry in found]
