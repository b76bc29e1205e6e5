"""The side of a vehicle that no frame saw, from the side that some did.

Vehicles are symmetric. A car that overtakes shows one flank and part of its rear; seen from the next lane
that would be a board. The far side is the near one mirrored, and between the two the edges are drawn across.
Nothing is put where a frame saw something else.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from dreamdrive.decompose.glances import is_whole
from dreamdrive.decompose.lives import Glimpse, unseen_by
from dreamdrive.scene.gaussians import Gaussians

_LENGTH_M, _HEIGHT_M = (2.5, 9.0), (0.8, 4.0)  # of what is believed to be the flank of a vehicle
_LEAST_FRAMES = 5  # that saw it
_LOW_WIDTH_M, _HIGH_WIDTH_M = 1.85, 2.1  # of vehicles lower and higher than ...
_HIGH_M = 1.9
_SEEN_SHARE = 0.7  # of the width from which on it counts as seen
_OUTER = 0.02  # share of the points that lie outside
_APART_M = 0.08  # of what is added, from one another and ...
_BESIDE_M = 0.2  # ... from what was seen
_EDGE_M = 0.25  # of a flank, behind its outline: what is drawn across
_STEP_M = 0.12


@dataclass(frozen=True)
class _Body:
    """Axes of a vehicle in its canonical place, and its plane of symmetry: ``left @ point = middle_m``."""

    ahead: Float[np.ndarray, "3"]
    left: Float[np.ndarray, "3"]
    up: Float[np.ndarray, "3"]
    middle_m: float


def completed(
    seen: Gaussians,
    ahead: Float[np.ndarray, "3"],
    up: Float[np.ndarray, "3"],
    glimpses: Sequence[Glimpse],
    reach_px: float,
) -> Gaussians | None:
    """What is added to the Gaussians of an actor, all in canonical places; None where nothing is.

    What was seen whole is left as it is. ``ahead`` is where it points, ``up`` the axis of yaw; neighbours in
    an image are ``reach_px`` apart.
    """
    places = seen.means.numpy().astype(np.float64)
    body = _body(places, ahead, up, glimpses)
    if body is None or len(glimpses) < _LEAST_FRAMES or not _cut_off(glimpses, reach_px):
        return None
    source = _thinned(places)
    mirrored = _mirrored(seen.select(torch.from_numpy(source)), body)
    across = _across(seen, source, body)
    added = Gaussians.concatenate(mirrored, across)
    at = added.means.numpy().astype(np.float64)
    free = np.all([unseen_by(glimpse, at, reach_px) for glimpse in glimpses], axis=0)
    beside, _ = KDTree(places).query(at, distance_upper_bound=_BESIDE_M)
    kept = np.flatnonzero(free & ~np.isfinite(beside))
    # Mirrored ones come first: they know the colours of a rear of which one half was seen.
    kept = kept[_thinned(at[kept])]
    return added.select(torch.from_numpy(kept)) if len(kept) else None


def _cut_off(glimpses: Sequence[Glimpse], reach_px: float) -> bool:
    """Whether the border of the picture cuts off the largest view of it."""
    largest = max(glimpses, key=lambda glimpse: len(glimpse.copies))
    return not is_whole(largest.copies, largest.camera.width_px, reach_px)


def _body(
    places: Float[np.ndarray, "n 3"],
    ahead: Float[np.ndarray, "3"],
    up: Float[np.ndarray, "3"],
    glimpses: Sequence[Glimpse],
) -> _Body | None:
    left = np.cross(up, ahead)
    along, across, height = (np.quantile(places @ axis, [_OUTER, 1 - _OUTER]) for axis in (ahead, left, up))
    tall_m, wide_m = float(np.ptp(height)), float(np.ptp(across))
    long_m = float(np.ptp(along))
    if not (_LENGTH_M[0] < long_m < _LENGTH_M[1] and _HEIGHT_M[0] < tall_m < _HEIGHT_M[1]):
        return None
    usual_m = _HIGH_WIDTH_M if tall_m > _HIGH_M else _LOW_WIDTH_M
    if wide_m > _SEEN_SHARE * usual_m:
        return None
    eyes = [np.linalg.inv(g.world_from_canonical) @ g.camera.world_from_camera[:, 3] for g in glimpses]
    sides = np.array([eye[:3] @ left for eye in eyes])
    from_left, from_right = (sides > across[1]).sum(), (sides < across[0]).sum()
    if from_left == from_right:
        return None
    middle_m = across[1] - usual_m / 2 if from_left > from_right else across[0] + usual_m / 2
    return _Body(ahead, left, up, float(middle_m))


def _thinned(places: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, " m"]:
    """The first of the points in each cell of a grid."""
    cells = np.floor(places / _APART_M).astype(np.int64)
    return np.sort(np.unique(cells, axis=0, return_index=True)[1])


def _mirrored(seen: Gaussians, body: _Body) -> Gaussians:
    mirror = np.eye(3) - 2 * np.outer(body.left, body.left)
    places = seen.means.numpy() @ mirror.T + 2 * body.middle_m * body.left
    turned = Rotation.from_quat(seen.quaternions.numpy(), scalar_first=True).as_matrix()
    # A mirrored axis system is left-handed; an ellipsoid looks the same with one of its axes turned round.
    turned = mirror @ turned * [1, 1, -1]
    quaternions = Rotation.from_matrix(turned).as_quat(scalar_first=True)
    return _replaced(seen, places, quaternions, seen.log_scales)


def _across(seen: Gaussians, source: Int[np.ndarray, " m"], body: _Body) -> Gaussians:
    """The edges of the flanks, drawn from one to the other."""
    places = seen.means.numpy().astype(np.float64)[source]
    edge = source[_on_outline(places @ body.ahead, places @ body.up)]
    at = seen.means.numpy().astype(np.float64)[edge]
    half_m = at @ body.left - body.middle_m
    steps = np.maximum((2 * np.abs(half_m) / _STEP_M).astype(int), 0)
    rows = np.repeat(np.arange(len(edge)), steps)
    share = np.concatenate([(np.arange(n) + 1) / (n + 1) for n in steps]) if len(rows) else np.zeros(0)
    drawn = at[rows] - (2 * half_m[rows] * share)[:, None] * body.left
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
