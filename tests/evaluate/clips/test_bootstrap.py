"""Floors, intervals and ratios of distances between sets of clips."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.evaluate.clips.bootstrap import distance_with_interval, mean_with_interval
from dreamdrive.evaluate.clips.frechet import frechet_distance

Clips = Sequence[np.ndarray]


def places(seed: int, clips: int = 12, samples: int = 20, d: int = 6) -> list[np.ndarray]:
    """Features of clips that differ from each other more than their frames do."""
    rng = np.random.default_rng(seed)
    return [rng.normal(size=d) + 0.3 * rng.normal(size=(samples, d)) for _ in range(clips)]


def disturbed(clips: Clips, amount: float, seed: int = 0) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [clip + amount + 0.1 * rng.normal(size=clip.shape) for clip in clips]


def test_the_value_is_the_plain_distance_and_inside_its_interval() -> None:
    real, fake = places(0), places(1, clips=9)
    figure = distance_with_interval(real, fake, partial(frechet_distance, covariance="population"))
    assert figure.value == frechet_distance(np.concatenate(real), np.concatenate(fake), "population")
    assert figure.low is not None
    assert figure.high is not None
    assert figure.low < figure.value < figure.high
    assert (figure.real_clips, figure.real_samples) == (12, 240)
    assert (figure.fake_clips, figure.fake_samples) == (9, 180)


def test_one_seed_gives_one_figure() -> None:
    real, fake = places(0), places(1)
    first, again = (
        distance_with_interval(real, fake, frechet_distance, resamples=20, seed=3) for _ in range(2)
    )
    assert first == again
    assert first.low != distance_with_interval(real, fake, frechet_distance, resamples=20, seed=4).low


def test_the_interval_is_as_wide_as_the_scatter_over_other_clips() -> None:
    values = [
        frechet_distance(np.concatenate(places(2 * i)), np.concatenate(places(2 * i + 1))) for i in range(60)
    ]
    figures = [distance_with_interval(places(2 * i), places(2 * i + 1), frechet_distance) for i in range(5)]
    widths = [f.high - f.low for f in figures if f.high is not None and f.low is not None]
    assert 0.5 < np.mean(widths) / (np.quantile(values, 0.975) - np.quantile(values, 0.025)) < 2


def test_pairs_are_known_better_than_strangers() -> None:
    real = places(0)
    fake = disturbed(real, 0.2)
    paired = distance_with_interval(real, fake, frechet_distance, paired=True)
    alone = distance_with_interval(real, fake, frechet_distance)
    assert paired.value == alone.value
    assert paired.high - paired.low < 0.5 * (alone.high - alone.low)  # type: ignore[operator]


def test_the_floor_is_what_a_perfect_set_gets() -> None:
    pool = np.random.default_rng(0).normal(size=(400, 8))
    figure = distance_with_interval([pool[:200]], [pool[200:]], frechet_distance)
    assert figure.half == pytest.approx(figure.floor, rel=0.25)
    assert figure.value < figure.floor  # more samples, less distance
    assert (figure.low, figure.high) == (None, None)


def test_sets_too_small_for_a_floor() -> None:
    with pytest.raises(InputError, match="a set has 3 samples"):
        distance_with_interval([np.eye(5)], [np.eye(3, 5)], frechet_distance)


def test_sets_that_do_not_pair() -> None:
    real = places(0)
    with pytest.raises(InputError, match="got 12 real and 11 fake"):
        distance_with_interval(real, real[:11], frechet_distance, paired=True)


def test_a_mean_is_over_frames_and_its_interval_over_clips() -> None:
    values = [np.array([1.0, 1.0, 1.0]), np.array([5.0])]
    mean, low, high = mean_with_interval(values)
    assert mean == 2
    assert low is not None
    assert high is not None
    assert low < 2 < high
    assert mean_with_interval(values[:1]) == (1, None, None)
