"""Occupied ground, read off the Gaussians of a scene.

The paper optimises trajectories against "filtered 3D Gaussians as occupied points" and says no more of it.
Here a cell of the plane is taken at a time where enough opaque and small Gaussians lie at the height of a
car.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from dreamdrive.errors import InputError
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.level import level_from_world
from dreamdrive.scene.scene import Scene

CELL_M = 0.5
"""Side of a cell, that of the planning metrics."""


@dataclass(frozen=True)
class OccupancyOptions:
    """Which Gaussians count, and how many of them take a cell.

    Attributes:
        least_opacity: Fainter ones are fog and floaters.
        largest_m: Standard deviation along the longest axis above which one is sky or far away.
        lowest_m: Height above the road from which a car would hit it: kerbs are lower.
        highest_m: Height up to which it would: a car, and a margin.
        opacity: Sum that takes a cell, of Gaussians or parts of them.
        least_cells: So many taken ones have to touch one another: fewer are floaters.
        spread: Where the parts of a Gaussian are, in its deviations: far ones are larger than a cell.
    """

    least_opacity: float = 0.5
    largest_m: float = 1.0
    lowest_m: float = 0.3
    highest_m: float = 2.0
    opacity: float = 2.5
    least_cells: int = 2
    spread: float = 0.7


OCCUPANCY = OccupancyOptions()
"""As many cells right as can be, see ``benchmarks/occupancy.py``."""
CAUTIOUS = OccupancyOptions(opacity=1.5, least_cells=3)
"""For planners: less of what is far is missed, and more is taken that is free."""


@dataclass(frozen=True)
class Obstacles:
    """Cells that are taken, by their middles in the level frame of a scene, see ``level_from_world``.

    Attributes:
        level_from_world: To x, y on the road and z up, the road at 0 below the first camera.
        standing_m: Of what never moves.
        times_s: At which the moving ones are known.
        moving_m: Of what moves, at each of these times.
    """

    level_from_world: Float[np.ndarray, "4 4"]
    standing_m: Float[np.ndarray, "n 2"]
    times_s: Float[np.ndarray, " t"]
    moving_m: tuple[Float[np.ndarray, "_ 2"], ...]

    def at(self, step: int) -> Float[np.ndarray, "k 2"]:
        """All that is taken at one of the times."""
        return np.concatenate([self.standing_m, self.moving_m[step]])


def obstacles_of(
    scene: Scene,
    times_s: Sequence[float],
    options: OccupancyOptions = OCCUPANCY,
    now_s: float | None = None,
) -> Obstacles:
    """What stands in the way in a scene.

    Args:
        scene: The scene.
        times_s: When; they may lie beyond its frames.
        options: What counts.
        now_s: A moment from which on everything that moves goes on at the rate of its track, whatever the
            scene shows of it later; without it, what the scene shows at each time.

    Raises:
        InputError: The scene does not know its road, or its street is one of single frames.
    """
    if scene.moves_per_frame:
        raise InputError(
            "the street of this scene is one of single frames: it has no place in which anything could be hit"
        )
    level = level_from_world(scene)
    standing = _taken(scene.without_filled().static_at(0.0), level, options)
    moving = tuple(
        _taken(scene.dynamic_at(t_s) if now_s is None else _carried_on(scene, now_s, t_s), level, options)
        for t_s in times_s
    )
    return Obstacles(level, standing, np.array(times_s, dtype=np.float64), moving)


def _carried_on(scene: Scene, now_s: float, t_s: float) -> Gaussians:
    """What moves as it is seen now, carried along by the tracks of its actors.

    Surfaces live only as long as frames have seen them, and some of them would be gone.
    """
    now = scene.dynamic_at(now_s)
    if now.actor is None or scene.provenance.up is None:
        return now
    up = np.array(scene.provenance.up)
    means, quaternions = now.means.clone(), now.quaternions.clone()
    for actor in scene.actors:
        rows = torch.nonzero(now.actor == actor.id).squeeze(1)
        here, there = (actor.track.at(np.array([each])) for each in (now_s, t_s))
        turn = Rotation.from_rotvec(float(there.yaw_rad[0] - here.yaw_rad[0]) * up)
        away = now.means[rows].numpy() - here.positions_m[0]
        means[rows] = torch.from_numpy(turn.apply(away) + there.positions_m[0]).to(means)
        own = Rotation.from_quat(now.quaternions[rows].numpy(), scalar_first=True)
        quaternions[rows] = torch.from_numpy((turn * own).as_quat(scalar_first=True)).to(quaternions)
    return replace(now, means=means, quaternions=quaternions)


def _taken(
    gaussians: Gaussians, level: Float[np.ndarray, "4 4"], options: OccupancyOptions
) -> Float[np.ndarray, "k 2"]:
    """Middles of cells that hold enough, without those that lie alone."""
    opacity = torch.sigmoid(gaussians.logit_opacities).numpy()
    deviations_m = gaussians.log_scales.exp().numpy()
    places = gaussians.means.numpy() @ level[:3, :3].T + level[:3, 3]
    reach_m = options.spread * options.largest_m
    counts = (opacity >= options.least_opacity) & (deviations_m.max(axis=1, initial=0) <= options.largest_m)
    counts &= (places[:, 2] >= options.lowest_m - reach_m) & (places[:, 2] <= options.highest_m + reach_m)
    turns = Rotation.from_quat(gaussians.quaternions.numpy()[counts], scalar_first=True).as_matrix()
    axes = (level[:3, :3] @ turns) * (options.spread * deviations_m[counts])[:, None]
    out = [sign * axes[:, :, axis] for axis in range(3) for sign in (-1, 1)]
    parts = np.concatenate([places[counts], *(places[counts] + each for each in out)])
    share = np.tile(opacity[counts] / (1 + len(out)), 1 + len(out))
    high = (parts[:, 2] >= options.lowest_m) & (parts[:, 2] <= options.highest_m)
    cells, of = np.unique(np.floor(parts[high, :2] / CELL_M).astype(np.int64), axis=0, return_inverse=True)
    total = np.bincount(of.reshape(-1), weights=share[high], minlength=len(cells))
    cells = cells[total >= options.opacity]
    return (cells[_together(cells, options.least_cells)] + 0.5) * CELL_M


def _together(cells: Int[np.ndarray, "n 2"], least: int) -> Bool[np.ndarray, " n"]:
    """Which cells are of so many that touch one another, if only by corners."""
    if not len(cells):
        return np.zeros(0, bool)
    pairs = KDTree(cells).query_pairs(1.5, output_type="ndarray")
    touching = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(cells), len(cells)))
    _, group = connected_components(touching, directed=False)
    return np.asarray(np.bincount(group)[group] >= least)
