"""Gaussians at moments: what a player needs to show all that is in between."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float, Int

from dreamdrive.data.splats.splats import UP_AND_BACK
from dreamdrive.errors import InputError
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.harmonics import sh_rotation
from dreamdrive.scene.scene import Scene

_REACH = math.sqrt(2 * math.log(255.0))
"""Deviations from the centre of its life span beyond which no Gaussian can be seen."""
_SHORTEST_S = 1e-6
"""A life span counts as no shorter, as in ``Gaussians.faded_at``."""


@dataclass(frozen=True)
class AtMoments:
    """N Gaussians, each at the moments at which it can be seen, M rows in all.

    Attributes:
        first: First moment of each (N,).
        last: Last moment of each (N,), at least the first.
        means: In metres (M, 3), of each Gaussian the rows of its moments one after another.
        quaternions: Likewise (M, 4), wxyz, of unit length; neighbours in time have the nearer sign.
        log_scales: Likewise (M, 3).
        opacities: Without life spans (N,), 0 to 1.
        lives_s: Time of full visibility and deviation in seconds (N, 2); a deviation of 0 is always.
        sh: Colour (N, K, 3).
    """

    first: Int[np.ndarray, " n"]
    last: Int[np.ndarray, " n"]
    means: Float[np.ndarray, "m 3"]
    quaternions: Float[np.ndarray, "m 4"]
    log_scales: Float[np.ndarray, "m 3"]
    opacities: Float[np.ndarray, " n"]
    lives_s: Float[np.ndarray, "n 2"]
    sh: Float[np.ndarray, "n k 3"]

    @property
    def offsets(self) -> Int[np.ndarray, " n"]:
        """Row of the first moment of each."""
        counts = self.last - self.first + 1
        return np.cumsum(counts) - counts


def moments_of(scene: Scene, times_s: Sequence[float] | None) -> Float[np.ndarray, " t"]:
    """The times to write: those given, else the recorded ones; ``InputError`` where they do not grow."""
    moments_s = scene.times_s[scene.front] if times_s is None else np.asarray(times_s, np.float64)
    if len(moments_s) == 0 or not np.isfinite(moments_s).all() or (np.diff(moments_s) <= 0).any():
        raise InputError("times: expected at least one, each later than the one before")
    return moments_s


@torch.no_grad()
def at_moments(scene: Scene, moments_s: Float[np.ndarray, " t"]) -> tuple[AtMoments, AtMoments]:
    """The static and the dynamic Gaussians of a scene at moments, which grow.

    Raises:
        InputError: See ``Scene.moved_at``.
    """
    static = scene.static.without_features()
    stands = moments_s[:1] if static.velocity is None else moments_s

    def carried(gaussians: Gaussians, t_s: float) -> Gaussians:
        return gaussians.moved_to(t_s)

    dynamic = scene.dynamic.without_features()
    return _sampled(static, stands, carried), _sampled(dynamic, moments_s, scene.moved_at)


def _sampled(
    gaussians: Gaussians,
    moments_s: Float[np.ndarray, " t"],
    moved: Callable[[Gaussians, float], Gaussians],
) -> AtMoments:
    lives_s = _lives(gaussians)
    first, last = _seen(lives_s, moments_s)
    counts = last - first + 1
    offsets = np.cumsum(counts) - counts
    rows = int(counts.sum())
    means, turns, sizes = (np.zeros((rows, k), np.float32) for k in (3, 4, 3))
    for moment, t_s in enumerate(moments_s.tolist()):
        own = np.flatnonzero((first <= moment) & (moment <= last))
        there = moved(gaussians.select(torch.from_numpy(own)), t_s)
        row = offsets[own] + moment - first[own]
        means[row] = there.means.numpy(force=True)
        sizes[row] = there.log_scales.numpy(force=True)
        unit = torch.nn.functional.normalize(there.quaternions, dim=1).numpy(force=True)
        before = turns[np.maximum(row - 1, 0)]
        turned = (moment > first[own]) & ((before * unit).sum(axis=1) < 0)
        turns[row] = np.where(turned[:, None], -unit, unit)
    opacities = torch.sigmoid(gaussians.logit_opacities).numpy(force=True)
    return AtMoments(first, last, means, turns, sizes, opacities, lives_s, gaussians.sh.numpy(force=True))


def _lives(gaussians: Gaussians) -> Float[np.ndarray, "n 2"]:
    if gaussians.lifespan is None:
        return np.zeros((len(gaussians), 2))
    lives_s = gaussians.lifespan.double().numpy(force=True)
    return np.stack([lives_s[:, 0], np.maximum(lives_s[:, 1], _SHORTEST_S)], axis=1)


def _seen(
    lives_s: Float[np.ndarray, "n 2"], moments_s: Float[np.ndarray, " t"]
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
    """The moments between which each can be seen: the last one before that, to the first one after it."""
    end = len(moments_s) - 1
    reach_s = np.where(lives_s[:, 1] > 0, _REACH * lives_s[:, 1], np.inf)
    first = np.searchsorted(moments_s, lives_s[:, 0] - reach_s, side="right") - 1
    last = np.searchsorted(moments_s, lives_s[:, 0] + reach_s, side="left")
    return np.clip(first, 0, end), np.clip(last, 0, end)


def joined(parts: tuple[AtMoments, AtMoments]) -> AtMoments:
    """Both as one."""
    names = AtMoments.__dataclass_fields__
    return AtMoments(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def turned_back(these: AtMoments) -> AtMoments:
    """The same in axes x right, y up, z back: half a turn about x."""
    w, x, y, z = these.quaternions.T
    degree = int(these.sh.shape[1] ** 0.5) - 1
    return replace(
        these,
        means=these.means @ UP_AND_BACK.astype(np.float32),
        quaternions=np.stack([-x, w, -z, y], axis=1),
        sh=np.einsum("ij,njc->nic", sh_rotation(UP_AND_BACK, degree).astype(np.float32), these.sh),
    )
