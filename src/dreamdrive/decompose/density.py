"""F_group with clusters of HDBSCAN over all Gaussians (eq. 10): the grouping of ``--method paper``."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree
from sklearn.cluster import HDBSCAN

METRES_PER_FRAME = 1.0
"""A training frame counts as so many metres: a car of a city street goes them at 10 Hz."""
METRES_PER_SCORE = 2.0
MOST = 20_000
"""Clustered at once; with more, every k-th is clustered and the others join the nearest of these."""


def density_labels(
    places_m: Float[np.ndarray, "n 3"],
    frames: Int[np.ndarray, " n"],
    scores: Float[np.ndarray, " n"],
    smallest: int,
) -> Int[np.ndarray, " n"]:
    """One label a cluster in space, time and score, -1 for what lies alone.

    Args:
        places_m: Where the Gaussians are.
        frames: Number of the training frame that each came from; held-out frames are not counted.
        scores: Their dynamic scores.
        smallest: Members that make a cluster.
    """
    values = np.column_stack([places_m, METRES_PER_FRAME * frames, METRES_PER_SCORE * scores])
    step = -(-len(values) // MOST)
    chosen = values[::step]
    if len(chosen) < 2 * smallest:
        return np.full(len(values), -1, dtype=np.int64)
    labels = HDBSCAN(min_cluster_size=max(2, smallest // step), copy=True).fit_predict(chosen)  # pyright: ignore[reportArgumentType]
    nearest = KDTree(chosen).query(values)[1]
    return labels[nearest].astype(np.int64)


def voted(
    labels: Int[np.ndarray, " n"], moving: Float[np.ndarray, " n"], majority: float
) -> Int[np.ndarray, " n"]:
    """The vote of eq. 10: numbers of the dynamic clusters from 0, -1 for what is static.

    Args:
        labels: Clusters; what lies alone, -1, keeps its own vote and makes one cluster with its like.
        moving: Votes, 1 for dynamic and 0 for static.
        majority: Share of the votes above which a cluster is dynamic as a whole.
    """
    known = labels >= 0
    share = np.bincount(labels[known], weights=moving[known]) / np.maximum(np.bincount(labels[known]), 1)
    dynamic = moving > 0
    dynamic[known] = share[labels[known]] > majority
    numbers = np.unique(labels[dynamic], return_inverse=True)[1]
    cluster = np.full(len(labels), -1, dtype=np.int64)
    cluster[dynamic] = numbers
    return cluster
