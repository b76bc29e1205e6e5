"""Geometry from pycolmap and OpenCV alone: no weights, no GPU."""

from collections.abc import Callable

from dreamdrive.geometry.cameras import STEPS, pose_clip, with_creep
from dreamdrive.geometry.dense import LOOK_PASSES, PASSES, densify
from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.geometry.protocol import GeometryBackend
from dreamdrive.geometry.road import in_metres
from dreamdrive.progress import Work
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


def reconstruct(clip: Clip, options: GeometryOptions, *, seed: int = 0, work: Work = Work()) -> Geometry:
    """Pose a clip and find its depth, see ``geometry.protocol``; no network.

    Steps are counted in frames that are gone through once. A step of posing takes about as long as one pass
    over all frames; what a clip does not need is jumped over.
    """
    passes, used = len(clip), int((~clip.held_out).sum())
    posing, dense = (1 + STEPS) * passes, PASSES if clip.look is None else PASSES + LOOK_PASSES
    total = posing + dense * used
    tell = _counted(work, 0, passes, total)
    posed = work.keep("posed", lambda: pose_clip(clip, options, seed=seed, tell=tell))
    known = in_metres(clip, posed.metres_per_unit)
    found = densify(known, posed, options, tell=_counted(work, posing, 1, total), keep=work.keep)
    if posed.fallback_kind == "standing" and clip.known.world_from_camera is None:
        found = with_creep(clip, found)
    work(total, total)
    return found


def _counted(work: Work, start: int, each: int, total: int) -> Callable[[], None]:
    """What tells of steps of one size, from a start on; the last one is told of by who knows that it was."""
    done = start

    def tell() -> None:
        nonlocal done
        done = min(done + each, total - 1)
        work(done, total)

    work(start, total)
    return tell


CLASSICAL = GeometryBackend(
    name="classical",
    reconstruct=reconstruct,
    about="structure from motion (pycolmap), plane sweep, optical flow: no weights, no GPU",
    licence="BSD-3-Clause (COLMAP), Apache-2.0 (OpenCV)",
    memory="1.3 GB for 24 frames at 480x270",
)
