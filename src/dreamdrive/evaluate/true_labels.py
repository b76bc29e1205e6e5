"""Which Gaussians of a scene stand for things that truly move."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Bool, Float

from dreamdrive.evaluate.truth import Truth
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene

BEHIND = 1.1
"""Depth over the true one from which on a Gaussian lies behind the surface that a pixel shows."""


@torch.no_grad()
def places(scene: Scene, t_s: float) -> Float[np.ndarray, "n 3"]:
    """Centres of all Gaussians at a time, the static ones first; also of those whose life span is over."""
    moved = scene.dynamic.without_features()
    if scene.deformation is not None:
        moved = scene.deformation.apply_at(moved, t_s)
    return torch.cat([scene.static.means, moved.means]).numpy().astype(np.float64)


def true_labels(
    scene: Scene, views: Sequence[Camera], truth: Truth, scale: float
) -> tuple[Bool[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
    """Whether each Gaussian, the static ones first, stands for something that moves; whether it was judged.

    A Gaussian is judged in the frame it was seeded from, where it is at that frame's time. It is moving if
    its centre falls on a pixel of a moving road user and does not lie behind it, by more than a tenth of the
    true depth. What lies nearer counts: the pixel shows nothing nearer than the road user, so that this is
    the road user itself at a wrong depth. One that has left the picture of its frame, or that names none, is
    judged in the frame where its depth is nearest to the true one. One that is in no picture, or before the
    sky only, is not judged.

    The views are the scene's cameras at the size of the truth; ``scale`` is metres of the truth for one of
    the scene.
    """
    source = torch.cat([scene.static.source_frame, scene.dynamic.source_frame]).numpy()
    moving = np.zeros(len(source), dtype=bool)
    # Logarithmic distance from the true depth in the frame that has judged so far; -1 is the last word.
    distance = np.full(len(source), np.inf)
    for frame, camera in enumerate(views):
        projected = camera.project(places(scene, float(scene.times_s[frame])))
        column, row, z = projected.T
        seen = np.flatnonzero(camera.shows(projected))
        pixel = frame, row[seen].astype(int), column[seen].astype(int)
        solid = truth.depth_m[pixel] > 0
        seen, pixel = seen[solid], (frame, pixel[1][solid], pixel[2][solid])
        ratio = scale * z[seen] / truth.depth_m[pixel]
        here = np.where(source[seen] == frame, -1.0, np.abs(np.log(ratio)))
        nearer = here < distance[seen]
        rows = seen[nearer]
        distance[rows] = here[nearer]
        moving[rows] = (truth.moving[pixel] & (ratio < BEHIND))[nearer]
    return moving, np.isfinite(distance)
