"""Whether the camera goes anywhere: where it does not, its path is noise and shows no unit."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.geometry.evidence import Evidence
from dreamdrive.scene.clip import Clip

STANDING_M = 0.5
"""A path in metres that nowhere leads further than this from its start may be that of a standing camera."""
_EXACT_M, _EXACT = 0.01, 1e-3  # poses that are one and the same: apart, and in the entries of the rotation
_SHOWN = 1e-3  # of the median depth: a path that spreads less is rounding


def stands(clip: Clip, evidence: Evidence) -> bool:
    """Whether the whole clip stands still, by the frames, and by its poses where these are in metres."""
    known = clip.known.world_from_camera
    if known is None or not clip.known.metric:
        return evidence.motion.standing
    away_m = float(np.linalg.norm(known[:, :3, 3] - known[0, :3, 3], axis=1).max())
    same = away_m < _EXACT_M and bool((np.abs(known[:, :3, :3] - known[0, :3, :3]) < _EXACT).all())
    # Traffic that fills the picture looks like a camera that moves.
    return same or (evidence.motion.standing and away_m < STANDING_M)


def without_poses(clip: Clip) -> Clip:
    """The clip as if no poses, and no points in their world, were known."""
    return replace(clip, known=replace(clip.known, world_from_camera=None, points=None))


def unit_in(
    known: Float[np.ndarray, "f 4 4"], own: Float[np.ndarray, "f 4 4"], depth: float, metric: bool = False
) -> float:
    """The unit of own poses in that of known ones: by how far both go from the middle of their paths.

    ``depth`` is the median in the unit of ``own``; with ``metric`` both units are the metre.

    Raises:
        InputError: One of the two stands still, and the units are not the same.
    """
    far, there = (
        float(np.linalg.norm(path - path.mean(axis=0))) for path in (known[:, :3, 3], own[:, :3, 3])
    )
    if there > _SHOWN * depth and far > 0:
        return far / there
    if metric:
        return 1.0
    which = "the given poses stand" if far == 0 else "by the network the camera stands"
    raise InputError(
        f"{which} still, but the clip does not: such poses cannot give depth its unit; leave them out, or "
        "choose frames between which the camera moves"
    )
