"""The side of a vehicle that no frame saw, from the side that some did.

Vehicles are symmetric. A car that overtakes shows one flank and part of its rear; seen from the next lane
that would be a board. The far side is the near one mirrored, and between the two the edges are drawn across.
Nothing is put where a frame saw something else.
"""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from dreamdrive.decompose.actors.body import Body
from dreamdrive.decompose.actors.life_spans import ActorView, unseen_by
from dreamdrive.decompose.actors.observations import is_whole
from dreamdrive.scene.gaussians import Gaussians

_LENGTH_M, _HEIGHT_M = (2.5, 9.0), (0.8, 4.0)  # of what is believed to be the flank of a vehicle
_SEEN_SHARE = 0.7  # of the width from which on it counts as seen
_LEAST_FRAMES = 5  # that saw it
_APART_M = 0.08  # of what is added, from one another and ...
_BESIDE_M = 0.2  # ... from what was seen
_EDGE_M = 0.25  # of a flank, behind its outline: what is drawn across
_STEP_M = 0.12


def completed(seen: Gaussians, body: Body, views: Sequence[ActorView], reach_px: float) -> Gaussians | None:
    """What is added to the Gaussians of an actor, all in canonical places; None where nothing is.

    What was seen whole is left as it is. Neighbours in an image are ``reach_px`` apart.
    """
    places = seen.means.numpy().astype(np.float64)
    if not _is_flank(body) or len(views) < _LEAST_FRAMES or not _cut_off(views, reach_px):
        return None
    source = _thinned(places)
    mirrored = _mirrored(seen.select(torch.from_numpy(source)), body)
    across = _across(seen, source, body)
    added = Gaussians.concatenate(mirrored, across)
    at = added.means.numpy().astype(np.float64)
    free = np.all([unseen_by(view, at, reach_px) for view in views], axis=0)
    beside, _ = KDTree(places).query(at, distance_upper_bound=_BESIDE_M)
    kept = np.flatnonzero(free & ~np.isfinite(beside))
    # Mirrored ones come first: they know the colours of a rear of which one half was seen.
    kept = kept[_thinned(at[kept])]
    return added.select(torch.from_numpy(kept)) if len(kept) else None


def _cut_off(views: Sequence[ActorView], reach_px: float) -> bool:
    """Whether the border of the picture cuts off the largest view of it."""
    largest = max(views, key=lambda view: len(view.copies))
    return not is_whole(largest.copies, largest.camera.width_px, reach_px)


def _is_flank(body: Body) -> bool:
    """Whether one side alone was seen of what may be a vehicle."""
    long_m, wide_m, tall_m = np.ptp(body.seen_m, axis=1)
    vehicle = _LENGTH_M[0] < long_m < _LENGTH_M[1] and _HEIGHT_M[0] < tall_m < _HEIGHT_M[1]
    return bool(vehicle and wide_m < _SEEN_SHARE * np.ptp(body.whole_m[1]))


def _thinned(places: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, " m"]:
    """The first of the points in each cell of a grid."""
    cells = np.floor(places / _APART_M).astype(np.int64)
    return np.sort(np.unique(cells, axis=0, return_index=True)[1])


def _mirrored(seen: Gaussians, body: Body) -> Gaussians:
    left, middle_m = body.axes[1], body.whole_m[1].mean()
    mirror = np.eye(3) - 2 * np.outer(left, left)
    places = seen.means.numpy() @ mirror.T + 2 * middle_m * left
    turned = Rotation.from_quat(seen.quaternions.numpy(), scalar_first=True).as_matrix()
    # A mirrored axis system is left-handed; an ellipsoid looks the same with one of its axes turned round.
    turned = mirror @ turned * [1, 1, -1]
    quaternions = Rotation.from_matrix(turned).as_quat(scalar_first=True)
    return _replaced(seen, places, quaternions, seen.log_scales)


def _across(seen: Gaussians, source: Int[np.ndarray, " m"], body: Body) -> Gaussians:
    """The edges of the flanks, drawn from one to the other."""
    ahead, left, up = body.axes
    places = seen.means.numpy().astype(np.float64)[source]
    edge = source[_on_outline(places @ ahead, places @ up)]
    at = seen.means.numpy().astype(np.float64)[edge]
    half_m = at @ left - body.whole_m[1].mean()
    steps = np.maximum((2 * np.abs(half_m) / _STEP_M).astype(int), 0)
    rows = np.repeat(np.arange(len(edge)), steps)
    share = np.concatenate([(np.arange(n) + 1) / (n + 1) for n in steps]) if len(rows) else np.zeros(0)
    drawn = at[rows] - (2 * half_m[rows] * share)[:, None] * left
    wide = torch.full((len(rows), 3), float(np.log(0.5 * _STEP_M)))
    upright = np.tile([1.0, 0, 0, 0], (len(rows), 1))
    return _replaced(seen.select(torch.from_numpy(edge[rows])), drawn, upright, wide)


def _on_outline(
    along_m: Float[np.ndarray, " n"], height_m: Float[np.ndarray, " n"]
) -> Bool[np.ndarray, " n"]:
    """Which points of a flank lie at its upper, front or rear edge."""
    return _at_ends(height_m, along_m) | _at_top(along_m, height_m)


def _at_top(where: Float[np.ndarray, " n"], value: Float[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    cell = np.floor((where - where.min()) / _EDGE_M).astype(int)
    top = np.full(cell.max() + 1, -np.inf)
    np.maximum.at(top, cell, value)
    return value > top[cell] - _EDGE_M


def _at_ends(where: Float[np.ndarray, " n"], value: Float[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    return _at_top(where, value) | _at_top(where, -value)


def _replaced(
    like: Gaussians,
    places: Float[np.ndarray, "n 3"],
    quaternions: Float[np.ndarray, "n 4"],
    log_scales: torch.Tensor,
) -> Gaussians:
    colour = like.sh.clone()
    colour[:, 1:] = 0
    return Gaussians(
        means=torch.tensor(places, dtype=torch.float32),
        quaternions=torch.tensor(quaternions, dtype=torch.float32),
        log_scales=log_scales.clone(),
        logit_opacities=like.logit_opacities.clone(),
        sh=colour,
        source_frame=like.source_frame,
        features=like.features,
    )
