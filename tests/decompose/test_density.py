"""The grouping of the paper: clusters of HDBSCAN over all Gaussians, and their vote."""

import numpy as np

from dreamdrive.decompose import density
from dreamdrive.decompose.density import density_labels, voted


def two_things(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    places = random.normal(0, 0.3, (140, 3))
    places[80:] += [20, 0, 5]
    return places, np.zeros(len(places), dtype=np.int64)


def test_things_apart_in_space_or_in_time_are_clusters_of_their_own() -> None:
    places, frames = two_things()
    scores = np.full(len(places), 0.2)
    labels = density_labels(places, frames, scores, 12)
    assert len(set(labels[:80]) - {-1}) == len(set(labels[80:]) - {-1}) == 1
    assert (labels >= 0).mean() > 0.9
    again = density_labels(np.concatenate([places[:80]] * 2), np.repeat([0, 30], 80), np.zeros(160), 12)
    assert len(set(again.tolist()) - {-1}) == 2


def test_with_more_than_can_be_clustered_at_once_the_others_join_the_nearest(monkeypatch) -> None:
    places, frames = two_things()
    scores = np.full(len(places), 0.2)
    monkeypatch.setattr(density, "MOST", 70)
    labels = density_labels(places, frames, scores, 12)
    assert len(set(labels[:80]) & set(labels[80:]) - {-1}) == 0
    assert (labels >= 0).mean() > 0.8


def test_few_gaussians_are_no_cluster() -> None:
    assert density_labels(np.zeros((5, 3)), np.zeros(5, np.int64), np.zeros(5), 12).tolist() == [-1] * 5


def test_more_than_half_decide_and_what_lies_alone_keeps_its_vote() -> None:
    labels = np.array([0, 0, 0, 1, 1, 1, 1, -1, -1])
    moving = np.array([1, 1, 0, 1, 1, 0, 0, 1, 0], dtype=np.float64)
    assert voted(labels, moving, 0.5).tolist() == [1, 1, 1, -1, -1, -1, -1, 0, -1]
