"""Structure from motion of a clip with its gate: a believable model, or why there is none."""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.geometry.cameras import gate, sfm
from dreamdrive.geometry.cameras.focal import Settled, settle
from dreamdrive.geometry.cameras.sfm import Model
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
STARTS = 6
"""Random starting positions of global mapping that are tried."""


@dataclass(frozen=True)
class Outcome:
    """What structure from motion gave: an accepted model, or why and in what kind there is none.

    Notes are sentences on what else was noticed; figures those of the gate and the focal test, as JSON
    values.
    """

    settled: Settled | None
    reasons: tuple[str, ...]
    notes: tuple[str, ...]
    figures: dict[str, Any]
    refusal: Fallback | None = None


def reconstruct(
    clip: Clip, evidence: Evidence, options: GateOptions, seed: int, tell: Tell = unheard
) -> Outcome:
    """Global mapping, focal test and gate; other mappings when the gate refuses; else the reasons.

    Global mapping starts at random positions, and now and then ends in a folded path: other starts are tried
    before incremental mapping. ``tell`` is called after features, after matches, and with the model.
    """
    if len(clip) < MIN_FRAMES:
        return _refused(f"{len(clip)} frames are too few for structure from motion", "few")
    found = find_features(clip, evidence)
    tell()
    typical = int(np.median([len(entry.keypoints_px) for entry in found]))
    if typical < MIN_FEATURES:
        return _refused(f"the frames show too little: {typical} features in a typical one", "blank")
    square, found = _square_pixels(evidence.working, found)
    little = shows_little(clip, evidence)
    notes: list[str] = []
    reasons: tuple[str, ...] = ()
    figures: dict[str, Any] = {"features": typical}
    with tempfile.TemporaryDirectory(prefix="dreamdrive-sfm-") as folder:
        database = Path(folder) / "matches.db"
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
                    notes += ["the camera drives backwards"] if verdict.backwards else []
                    notes += [_wobbling(settled.model)] if verdict.wobbling else []
                    notes += [f"{reasons[0]}: mapped again, {again}"] if reasons else []
                    return Outcome(settled, (), tuple(notes), figures)
            reasons = reasons or failed
    return Outcome(None, reasons, (), figures, "refused")


def _attempts(seed: int) -> list[tuple[str, str, int]]:
    """Mapper, how it differs from the first, in words, and its seed."""
    others = [("global", "from another start", (seed + k) % 2**31) for k in range(STARTS)]
    return [*others, ("incremental", "frame by frame", seed)]


def _refused(reason: str, refusal: Fallback) -> Outcome:
    return Outcome(None, (reason,), (), {}, refusal)


def _wobbling(model: Model) -> str:
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
