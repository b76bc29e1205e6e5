"""Geometry of a clip by one of the backends."""

from itertools import count
from pathlib import Path

import numpy as np

from dreamdrive.geometry.cameras import refined
from dreamdrive.geometry.options import GeometryOptions
from dreamdrive.geometry.protocol import GeometryBackend
from dreamdrive.geometry.surround import reconstruct_cameras
from dreamdrive.geometry.table import BACKENDS
from dreamdrive.progress import Work
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry


def backend_of(method: str, weights: Path | None = None) -> GeometryBackend:
    """A way of getting geometry by its name, if it could start with these weights.

    Raises:
        InputError: The method is unknown, lacks weights or its package, or takes no weights.
    """
    backend = BACKENDS.choose(method)
    backend.check_start("geometry", weights)
    return backend


def reconstruct(
    clip: Clip,
    options: GeometryOptions = GeometryOptions(),
    *,
    seed: int = 0,
    work: Work = Work(),
) -> Geometry:
    """Reconstruct a clip by one of ``BACKENDS``; geometry given as files comes in by ``attach``.

    For clips of several cameras see ``surround``. ``work`` is told of each step, where the method can count
    them.

    Raises:
        InputError: See ``backend_of``; or the clip, its known poses or the weights cannot be used.
    """
    backend = backend_of(options.method, options.weights)

    def how(part: Clip, work: Work = work) -> Geometry:
        return backend.reconstruct(part, options, seed=seed, work=work)

    if options.refine_poses:
        return refined(clip, how)
    if len(clip.rig) == 1:
        return how(clip)
    cameras, turn = len(np.unique(clip.camera)), count()
    return reconstruct_cameras(clip, lambda part: how(part, work.part(next(turn), cameras)))
