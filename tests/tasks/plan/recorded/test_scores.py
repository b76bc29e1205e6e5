"""How steps become figures of horizons."""

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan import Reading, StepScores, summarise

DISTANCES = np.array([[1.0, 2, 3, 4, 5, 6], [3.0, 4, 5, 6, 7, 8]])
HITS = np.array([[0, 1, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]], bool)
SCORES = StepScores(DISTANCES, HITS, None, np.zeros_like(HITS), skipped=3)


@pytest.mark.parametrize(
    ("reading", "distances", "collisions", "cases"),
    [
        ("at", [3.0, 5.0, 7.0], [1, 0, 1], [2, 2, 2]),
        ("mean", [2.5, 3.5, 4.5], [1, 1, 3], [4, 8, 12]),
        ("any", [3.0, 5.0, 7.0], [1, 1, 2], [2, 2, 2]),
    ],
)
def test_figures_by_reading(
    reading: Reading, distances: list[float], collisions: list[int], cases: list[int]
) -> None:
    score = summarise(SCORES, reading)
    assert [each.horizon_s for each in score.horizons] == [1.0, 2.0, 3.0]
    assert [each.distance_m for each in score.horizons] == distances
    assert [each.collisions for each in score.horizons] == collisions
    assert [each.cases for each in score.horizons] == cases
    assert score.distance_m == pytest.approx(np.mean(distances))
    rates = np.array(collisions) / cases
    assert score.collision_rate == pytest.approx(rates.mean())
    assert (score.samples, score.skipped) == (2, 3)


@pytest.mark.parametrize("horizon_s", [0.0, 0.7, 3.5])
def test_a_horizon_between_steps_is_refused(horizon_s: float) -> None:
    with pytest.raises(InputError, match=f"figures at {horizon_s} s"):
        summarise(SCORES, "at", horizons_s=(horizon_s,))


def test_figures_of_no_sample_are_refused() -> None:
    none = StepScores(DISTANCES[:0], HITS[:0], None, HITS[:0], skipped=5)
    with pytest.raises(InputError, match="no sample is left"):
        summarise(none, "at")
