"""The path that the frames of a video themselves show."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from dreamdrive.geometry.cameras import MIN_TRACKS, fill, odometry, settle, sfm
from dreamdrive.geometry.evidence import Evidence, Features
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip

MIN_PLACED = 0.9
_HEIGHT_M = 1.5
"""Camera height for odometry; it sets no more than the unit, which a comparison of paths leaves free."""


@dataclass(frozen=True)
class Recovered:
    """A path found in the frames, in an arbitrary unit.

    The pinhole has the clip's size; a focal length that was not calibrated is refined if it shows.
    """

    world_from_camera: Float[np.ndarray, "f 4 4"]
    camera: Camera
    method: Literal["structure from motion", "odometry", "standing"]


def recover(
    clip: Clip, seen: Evidence, street: Bool[np.ndarray, "f h w"], found: Sequence[Features], seed: int
) -> Recovered | None:
    """Find the path of a clip of one camera; None where the frames show none.

    Structure from motion counts here even where ``geometry.reconstruct`` refuses it as too coarse to build a
    scene on: its residual is what inconsistent frames look like.

    The street that stands still is given at the size of ``seen.grey``, features at that of ``seen.working``.
    """
    camera = clip.rig[0]
    if seen.motion.tracks < MIN_TRACKS:
        return None
    if seen.motion.standing:
        return Recovered(np.tile(np.eye(4), (len(clip), 1, 1)), camera, "standing")
    mapped = _mapped(clip, seen, found, seed)
    if mapped is not None:
        return mapped
    path = odometry.drive(seen.grey, street, seen.small, clip.times_s, _HEIGHT_M)
    return Recovered(path.world_from_camera, camera, "odometry") if path.measured else None


def _mapped(clip: Clip, seen: Evidence, found: Sequence[Features], seed: int) -> Recovered | None:
    with tempfile.TemporaryDirectory(prefix="dreamdrive-path-") as folder:
        database = Path(folder) / "matches.db"
        sfm.match(database, found, seen.working, seed)
        model = sfm.map_globally(database, len(clip), seed)
        if model is None or model.registered.mean() < MIN_PLACED:
            return None
        camera = clip.rig[0]
        if not clip.known.intrinsics:
            settled = settle(database, model, seen.working, False, seed)
            if settled.model.registered.mean() < MIN_PLACED:
                return None
            model, factor = settled.model, float(settled.model.lens[0]) / seen.working.fx_px
            camera = replace(camera, fx_px=camera.fx_px * factor, fy_px=camera.fy_px * factor)
    return Recovered(fill(model.world_from_camera, clip.times_s), camera, "structure from motion")
