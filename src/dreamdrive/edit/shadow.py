"""The shadow of an actor: found on road that was seen beside it alone, and taken off."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree
from torch import Tensor

from dreamdrive.scene.actor import Actor
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.scene import Scene

UNSEEN = 0.1
"""Share of what a Gaussian would add to its best view, below which views have not seen it."""
LEAST_WEIGHT = 0.05
"""Of a Gaussian in any view, in pixels: fainter ones are no matter."""
REACH_M = 1.0
"""Beside its box, where an actor's shadow is looked for: with 1.5 m drawn streets gain as much, and with 2 m
much that is dark by itself is made brighter."""
DARK = 0.8
"""Of the brightness of the road around: what is lighter is left as it is."""
_LOW_M, _AROUND_M = 0.25, 4.0
_NEIGHBOURS, _LEAST, _BRIGHTEST = 24, 8, 5.0


@dataclass(frozen=True)
class Shade:
    """Road in the shadow of an actor.

    Attributes:
        rows: Which of the static Gaussians (N,).
        share: How bright they are there, of the road around in the light (N,).
    """

    rows: Int[np.ndarray, " n"]
    share: Float[np.ndarray, " n"]

    def less(self, others: Bool[np.ndarray, " m"]) -> "Shade":
        """Without those of a mask of the static Gaussians."""
        kept = ~others[self.rows]
        return Shade(self.rows[kept], self.share[kept])


def places_beside(
    points: Float[np.ndarray, "n 3"], actor: Actor, t_s: float, up: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "n 3"]:
    """Where points are, ahead of, left of and above the middle of the bottom of an actor."""
    assert actor.box is not None
    at = actor.track.at(np.array([t_s]))
    ahead = actor.box.pointing(float(at.yaw_rad[0]), up)
    away_m = points - at.positions_m[0]
    return away_m @ np.stack([ahead, np.cross(up, ahead), up], axis=1)


def beside(places_m: Float[np.ndarray, "n 3"], actor: Actor, reach_m: float) -> Bool[np.ndarray, " n"]:
    """Which places are on the road, below an actor or as near to it."""
    assert actor.box is not None
    half_m = actor.box.size_m[:2] / 2 + reach_m
    return (np.abs(places_m[:, :2]) < half_m).all(axis=1) & (np.abs(places_m[:, 2]) < _LOW_M)


def within(places_m: Float[np.ndarray, "n 3"], actor: Actor) -> Bool[np.ndarray, " n"]:
    """Which places are well inside an actor, above the road."""
    assert actor.box is not None
    length_m, width_m, height_m = actor.box.size_m
    inside = np.abs(places_m[:, :2]) < 0.45 * np.array([length_m, width_m])
    return inside.all(axis=1) & (places_m[:, 2] > _LOW_M) & (places_m[:, 2] < height_m)


def shade_of(
    scene: Scene,
    actor: Actor,
    times_s: Sequence[float],
    seen: Float[Tensor, "v n"],
    most: Float[Tensor, " n"],
) -> Shade | None:
    """What was seen beside the actor alone and is darker than the road around; None where that is nothing.

    Args:
        scene: With the actor where it was.
        actor: One with a box.
        times_s: Those of the views.
        seen: What each static Gaussian adds to each view, in pixels.
        most: What it would add to the best of them with the actor away.
    """
    means = scene.static.means.double().numpy()
    places_m = np.stack([places_beside(means, actor, t_s, scene.up) for t_s in times_s])
    zone = np.stack([beside(each, actor, REACH_M) for each in places_m])
    full = torch.maximum(seen.amax(dim=0), most).numpy()
    alone = (full > LEAST_WEIGHT) & ((seen.numpy() * ~zone).max(axis=0) < UNSEEN * full)
    around = np.any([beside(each, actor, REACH_M + _AROUND_M) for each in places_m], axis=0)
    rows, light = np.flatnonzero(alone), np.flatnonzero(around & ~zone.any(axis=0))
    if min(len(rows), len(light)) < _LEAST:
        return None
    bright = _bright(scene.static)
    flat = means @ (np.eye(3) - np.outer(scene.up, scene.up))
    own, others = (_smooth(flat[each], bright[each], flat[rows]) for each in (rows, light))
    share = own / np.maximum(others, 1e-3)
    dark = share < DARK
    return Shade(rows[dark], share[dark]) if dark.any() else None


def without_shade(scene: Scene, shade: Shade) -> Scene:
    """The scene with the road in it as bright as around it; what is drawn on it stays."""
    sh, rows = scene.static.sh.clone(), torch.from_numpy(shade.rows)
    gain = torch.from_numpy(1 / np.maximum(shade.share, 1 / _BRIGHTEST)).float()
    lit = sh[rows] * gain[:, None, None]
    lit[:, 0] += (gain[:, None] - 1) * 0.5 / SH_C0
    sh[rows] = lit
    return replace(scene, static=replace(scene.static, sh=sh))


def _bright(gaussians: Gaussians) -> Float[np.ndarray, " n"]:
    return (gaussians.sh[:, 0] * SH_C0 + 0.5).clamp(min=0).mean(dim=1).double().numpy()


def _smooth(
    points: Float[np.ndarray, "m 3"], values: Float[np.ndarray, " m"], at: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, " n"]:
    """The median of the nearest ones."""
    _, nearest = KDTree(points).query(at, min(_NEIGHBOURS, len(points)))
    return np.median(values[nearest], axis=1)
