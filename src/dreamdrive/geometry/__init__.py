"""F_MVS (eq. 4): from a clip to cameras, depth, confidence, sky and evidence of motion."""

from functools import partial
from itertools import count
from pathlib import Path

import numpy as np

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends import CLASSICAL
from dreamdrive.geometry.backends.dust3r import DUST3R
from dreamdrive.geometry.backends.feedforward import FEED_FORWARD
from dreamdrive.geometry.cameras import refined
from dreamdrive.geometry.protocol import GeometryBackend
from dreamdrive.geometry.surround import reconstruct_cameras
from dreamdrive.progress import Progress, silent
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry

BACKENDS: dict[str, GeometryBackend] = {
    backend.name: backend for backend in (CLASSICAL, DUST3R, *FEED_FORWARD)
}


def backend_of(method: str, weights: Path | None = None) -> GeometryBackend:
    """A way of getting geometry by its name, if it could start with these weights.

    Raises:
        InputError: The method is unknown, lacks weights or its package, or takes no weights.
    """
    if method not in BACKENDS:
        raise InputError(f"Unknown geometry method {method!r}; choose from: {', '.join(BACKENDS)}.")
    backend = BACKENDS[method]
    backend.check_start("geometry", weights)
    return backend


def reconstruct(
    clip: Clip,
    *,
    camera_height_m: float | None = None,
    seed: int = 0,
    method: str = "classical",
    weights: Path | None = None,
    refine_poses: bool = False,
    progress: Progress = silent,
) -> Geometry:
    """Reconstruct a clip by a method of ``BACKENDS``; geometry given as files comes in by ``files.attach``.

    Args:
        clip: Frames, with what is known of their geometry; those of several cameras see ``surround``.
        camera_height_m: Height of the camera above the road; None assumes 1.5 m.
        seed: Seed of everything random.
        method: Name of the method.
        weights: The network's file or folder, for methods that have one.
        refine_poses: Whether known poses give the length of the path only, see ``refine``.
        progress: Told of each step, where the method can count them.

    Raises:
        InputError: See ``backend_of``; or the clip, its known poses or the weights cannot be used.
    """
    backend = backend_of(method, weights)
    how = partial(backend.reconstruct, camera_height_m=camera_height_m, seed=seed, weights=weights)
    if refine_poses:
        return refined(clip, partial(how, progress=progress))
    if len(clip.rig) == 1:
        return how(clip, progress=progress)
    cameras = len(np.unique(clip.camera))
    turn = count()

    def one(part: Clip) -> Geometry:
        before = next(turn)
        return how(part, progress=lambda done, total: progress(before * total + done, cameras * total))

    return reconstruct_cameras(clip, one)
