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
from dreamdrive.geometry.protocol import GeometryBackend, GeometryOptions
from dreamdrive.geometry.surround import reconstruct_cameras
from dreamdrive.progress import Work
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
    options: GeometryOptions = GeometryOptions(),
    *,
    seed: int = 0,
    work: Work = Work(),
) -> Geometry:
    """Reconstruct a clip by a method of ``BACKENDS``; geometry given as files comes in by ``files.attach``.

    For clips of several cameras see ``surround``. ``work`` is told of each step, where the method can count
    them.

    Raises:
        InputError: See ``backend_of``; or the clip, its known poses or the weights cannot be used.
    """
    backend = backend_of(options.method, options.weights)
    how = partial(
        backend.reconstruct,
        camera_height_m=options.camera_height_m,
        seed=seed,
        weights=options.weights,
    )
    if options.refine_poses:
        return refined(clip, lambda part: how(part, work=work))
    if len(clip.rig) == 1:
        return how(clip, work=work)
    cameras, turn = len(np.unique(clip.camera)), count()
    return reconstruct_cameras(clip, lambda part: how(part, work=work.part(next(turn), cameras)))
