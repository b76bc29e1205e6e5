"""Floors and intervals of distances between sets of clips: split halves, bootstrap over clips."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.errors import InputError

SPLITS = 10
"""Random halvings that a floor is the mean of."""
RESAMPLES = 200
"""Resamples of the clips behind an interval."""
MIN_SAMPLES = 4
"""Samples of a set whose halves still have a distance."""
LEVEL = 0.95
"""What share of the resamples an interval holds."""

Features = Sequence[Float[np.ndarray, "_ _"]]
"""Features (samples, d) of each clip of a set."""
Distance = Callable[[Float[np.ndarray, "n d"], Float[np.ndarray, "m d"]], float]


@dataclass(frozen=True)
class DistanceFigure:
    """A distance between two sets, with the numbers of feature vectors and of the clips they come from.

    Attributes:
        value: The distance of all samples.
        low: Lower end of its 95 % interval over clips; ``None`` where a set has one clip only.
        high: Upper end.
        floor: Mean distance of two random halves of the real set: what a perfect fake set of that size gets.
        half: Mean distance of a half of the fake set to a half of the real one: comparable with ``floor``,
            as ``value`` is not, because distances shrink as samples are added.
    """

    value: float
    low: float | None
    high: float | None
    floor: float
    half: float
    real_samples: int
    fake_samples: int
    real_clips: int
    fake_clips: int


def distance_with_interval(
    real: Features,
    fake: Features,
    distance: Distance,
    *,
    paired: bool = False,
    seed: int = 0,
    resamples: int = RESAMPLES,
) -> DistanceFigure:
    """A distance of the features of two sets of clips with its floor and its interval.

    Clips are drawn with replacement, because the frames of one clip are not independent. Duplicates raise a
    distance: the quantiles are therefore shifted by what the resamples exceed the value by on average, and
    the interval tells how much the value would scatter for other clips, of the same number. Clip i of paired
    sets shows the same place: they are drawn together. Without resamples there is no interval.

    Raises:
        InputError: Too few samples, or paired sets of different length.
    """
    if paired and len(real) != len(fake):
        raise InputError(
            f"paired sets need the same clips, got {len(real)} real and {len(fake)} fake ones; give both the "
            "same, or compare them unpaired"
        )
    rng = np.random.default_rng(seed)
    all_real, all_fake = np.concatenate(real), np.concatenate(fake)
    value = distance(all_real, all_fake)
    floor, (half,) = half_distances(all_real, (all_fake,), distance, rng)

    def resampled(chosen: Int[np.ndarray, " c"]) -> float:
        other = chosen if paired else rng.integers(0, len(fake), len(fake))
        return distance(np.concatenate([real[i] for i in chosen]), np.concatenate([fake[i] for i in other]))

    enough = min(len(real), len(fake)) > 1
    low, high = _interval(value, len(real) if enough else 1, resampled, rng, resamples)
    counts = (len(all_real), len(all_fake), len(real), len(fake))
    return DistanceFigure(value, low, high, floor, half, *counts)


def mean_with_interval(
    values: Sequence[Float[np.ndarray, " _"]], *, seed: int = 0, resamples: int = RESAMPLES
) -> tuple[float, float | None, float | None]:
    """Mean over all frames of all clips, and its 95 % interval over clips.

    The interval is ``None`` with one clip, and of an infinite mean.
    """
    rng = np.random.default_rng(seed)
    sums = np.array([clip.sum() for clip in values])
    counts = np.array([len(clip) for clip in values])
    mean = float(sums.sum() / counts.sum())
    if not np.isfinite(mean):
        return mean, None, None

    def resampled(chosen: Int[np.ndarray, " c"]) -> float:
        return float(sums[chosen].sum() / counts[chosen].sum())

    return mean, *_interval(mean, len(values), resampled, rng, resamples)


def half_distances(
    real: Float[np.ndarray, "n d"],
    fakes: tuple[Float[np.ndarray, "_ d"], ...],
    distance: Distance,
    rng: np.random.Generator,
    splits: int = SPLITS,
) -> tuple[float, tuple[float, ...]]:
    """Mean distances of a random half of the real samples to the other half, and to a half of each fake set.

    Sets of one length are halved alike, so that a fake half shows what the real half shows that it replaces.
    """
    for features in (real, *fakes):
        if len(features) < MIN_SAMPLES:
            raise InputError(
                f"a set has {len(features)} samples; a distance with its floor needs {MIN_SAMPLES} or more: "
                "give more frames or clips"
            )
    floors, others = np.zeros(splits), np.zeros((splits, len(fakes)))
    for split in range(splits):
        order = rng.permutation(len(real))
        middle = len(real) // 2
        first = real[order[:middle]]
        floors[split] = distance(first, real[order[middle:]])
        for number, fake in enumerate(fakes):
            same = order if len(fake) == len(real) else rng.permutation(len(fake))
            others[split, number] = distance(first, fake[same[len(fake) // 2 :]])
    return float(floors.mean()), tuple(others.mean(axis=0).tolist())


def _interval(
    value: float,
    clips: int,
    statistic: Callable[[Int[np.ndarray, " c"]], float],
    rng: np.random.Generator,
    resamples: int,
) -> tuple[float | None, float | None]:
    """Quantiles of the statistic of resampled clips, moved so that their mean is the value."""
    if clips < 2 or resamples == 0:
        return None, None
    values = np.array([statistic(rng.integers(0, clips, clips)) for _ in range(resamples)])
    low, high = np.quantile(values - values.mean(), [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(value + low), float(value + high)
