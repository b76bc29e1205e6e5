"""Other ways to decompose that hybrid is compared with: clusters of HDBSCAN and of voxels."""

import math
from collections.abc import Callable, Mapping
from itertools import combinations
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from dreamdrive.decompose import Grouping, GroupOptions, elected
from dreamdrive.options import Options
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians

METRES_PER_FRAME = 1.0
"""A training frame counts as so many metres: a car of a city street goes them at 10 Hz."""
METRES_PER_SCORE = 2.0
METRES_PER_FEATURE = 0.5
"""For a standard deviation of a feature."""
VOXEL_M = 1.0
REACH_M = 1.5
"""Clusters of HDBSCAN that are no farther apart are one: else each frame of a near car is one of its own."""
Before = Mapping[str, Any]
"""Results of the stages before, by name."""
Usual = Callable[[], Grouping]
Labels = Callable[[Float[np.ndarray, "m d"]], Int[np.ndarray, " m"]]
"""From what ``space_time`` gives to one label each, -1 for noise."""


def by_density(before: Before, options: Options, usual: Usual) -> Grouping:
    """HDBSCAN over space, time and score."""
    return _grouped(before, options.group, lambda of: density_labels(of[:, :5], options.group.smallest))


def by_density_and_features(before: Before, options: Options, usual: Usual) -> Grouping:
    """HDBSCAN over space, time, score and Z_ref."""
    return _grouped(before, options.group, lambda of: density_labels(of, options.group.smallest))


def by_voxels(before: Before, options: Options, usual: Usual) -> Grouping:
    """Candidates that hang together by voxels of a metre and a training frame."""
    return _grouped(before, options.group, lambda of: voxel_labels(of[:, :4]))


def density_labels(values: Float[np.ndarray, "m d"], smallest: int) -> Int[np.ndarray, " m"]:
    """Labels of HDBSCAN, clusters within ``REACH_M`` of one another joined, -1 for noise.

    Its own option for that, ``cluster_selection_epsilon``, fails with NumPy from 2.4 on (scikit-learn 1.9).
    """
    from sklearn.cluster import HDBSCAN

    if len(values) < smallest:
        return np.full(len(values), -1)
    labels = HDBSCAN(min_cluster_size=smallest, copy=True).fit_predict(values)
    clusters = labels.max() + 1
    if not clusters:
        return labels
    trees = [KDTree(values[labels == cluster]) for cluster in range(clusters)]
    touching = np.zeros((clusters, clusters))
    for a, b in combinations(range(clusters), 2):
        nearest, _ = trees[a].query(trees[b].data, distance_upper_bound=REACH_M)
        touching[a, b] = np.isfinite(nearest).any()
    thing = connected_components(touching, directed=False)[1]
    return np.where(labels >= 0, thing[labels], -1)


def voxel_labels(places: Float[np.ndarray, "m 4"]) -> Int[np.ndarray, " m"]:
    """One label for all voxels that touch, in space-time."""
    if not len(places):
        return np.zeros(0, dtype=np.int64)
    cells = np.floor(places / VOXEL_M).astype(np.int64)
    filled, which = np.unique(cells, axis=0, return_inverse=True)
    pairs = KDTree(filled).query_pairs(1.5, p=math.inf, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(filled),) * 2)
    return connected_components(graph, directed=False)[1][which.ravel()]


def majority(
    labels: Int[np.ndarray, " m"], scores: Float[np.ndarray, " m"], options: GroupOptions
) -> Int[np.ndarray, " m"]:
    """The vote of eq. 10 with hybrid's own constants: numbers of the dynamic clusters, -1 elsewhere."""
    known = labels >= 0
    wins = elected(labels[known], scores[known], options)
    return np.where(np.isin(labels, wins), np.searchsorted(wins, labels), -1)


def space_time(
    clip: Clip, seeds: Gaussians, value: Float[np.ndarray, " n"], index: Int[np.ndarray, " m"]
) -> Float[np.ndarray, "m d"]:
    """Place, training frame, score and Z_ref of some seeds, all as metres.

    Held-out frames are not counted: no cluster ends at them.
    """
    assert seeds.features is not None
    features = seeds.features.numpy()
    number = np.cumsum(~clip.held_out) - 1
    columns = [
        seeds.means.detach().numpy(),
        METRES_PER_FRAME * number[seeds.source_frame.numpy()],
        METRES_PER_SCORE * value,
        METRES_PER_FEATURE * features / np.maximum(features.std(axis=0), 1e-3),
    ]
    return np.column_stack(columns).astype(np.float64)[index]


def _grouped(before: Before, options: GroupOptions, labels: Labels) -> Grouping:
    clip, seeds = before["prior"], before["initialise"]
    value = before["score"].detach().numpy()
    index = np.flatnonzero(value > options.candidate)
    found = labels(space_time(clip, seeds, value, index))
    cluster = np.full(len(seeds), -1, dtype=np.int64)
    cluster[index] = majority(found, value[index], options)
    return Grouping(torch.from_numpy(cluster >= 0), torch.from_numpy(cluster))
