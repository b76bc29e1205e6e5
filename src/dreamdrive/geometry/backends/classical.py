"""Geometry from pycolmap and OpenCV alone: no weights, no GPU."""

from collections.abc import Callable
from pathlib import Path

from dreamdrive.geometry.cameras.mapping import STEPS
from dreamdrive.geometry.cameras.posing import Posed, pose_clip
from dreamdrive.geometry.dense import PASSES, Dense, densify
from dreamdrive.geometry.protocol import GeometryBackend, Progress, silent
from dreamdrive.geometry.road.known_depth import in_metres
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


def reconstruct(
    clip: Clip,
    *,
    camera_height_m: float | None = None,
    seed: int = 0,
    weights: Path | None = None,
    progress: Progress = silent,
) -> Geometry:
    """Pose a clip and find its depth, see ``geometry.protocol``; no network.

    Steps are counted in frames that are gone through once. A step of posing takes about as long as one pass
    over all frames; what a clip does not need is jumped over.
    """
    passes, used = len(clip), int((~clip.held_out).sum())
    posing, total = (1 + STEPS) * passes, (1 + STEPS) * passes + PASSES * used
    posed = pose_clip(
        clip, camera_height_m=camera_height_m, seed=seed, tell=_counted(progress, 0, passes, total)
    )
    dense = densify(in_metres(clip, posed.metres_per_unit), posed, tell=_counted(progress, posing, 1, total))
    progress(total, total)
    return assemble(clip, posed, dense)


def _counted(progress: Progress, start: int, each: int, total: int) -> Callable[[], None]:
    """What tells of steps of one size, from a start on; the last one is told of by who knows that it was."""
    done = start

    def tell() -> None:
        nonlocal done
        done = min(done + each, total - 1)
        progress(done, total)

    progress(start, total)
    return tell


def assemble(clip: Clip, posed: Posed, dense: Dense) -> Geometry:
    """What both halves found, as the next stages take it."""
    used = ~clip.held_out
    shares = {
        "depth_share": float((dense.depth_m[used] > 0).mean()),
        "confident_share": float((dense.confidence[used] > 0.25).mean()),
        "sky_share": float(dense.sky[used].mean()),
        "moving_share": float((dense.moving[used] >= 0.5).mean()),
    }
    return Geometry(
        cameras=posed.cameras,
        depth_m=dense.depth_m,
        confidence=dense.confidence,
        sky=dense.sky,
        moving=dense.moving,
        fixed_regions=posed.fixed_regions[None],
        region_names=posed.region_names,
        ground=posed.ground,
        scale=posed.scale,
        focal=posed.focal,
        detected=posed.detected,
        fallback=posed.fallback,
        details={**posed.details, **shares},
        fallback_kind=posed.fallback_kind,
        placed=posed.placed,
    )


CLASSICAL = GeometryBackend(
    name="classical",
    reconstruct=reconstruct,
    about="structure from motion (pycolmap), plane sweep, optical flow: no weights, no GPU",
    licence="BSD-3-Clause (COLMAP), Apache-2.0 (OpenCV)",
    memory="1.3 GB for 24 frames at 480x270",
)
