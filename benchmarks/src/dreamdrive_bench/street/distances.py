"""Fréchet distances of rendered novel views from the true ones, in a few dimensions that the truth spans.

A covariance of 1280 dimensions is not known from some hundred frames. All features of a network are therefore
projected onto the leading principal components of the truth's, pooled over worlds and novel views: centred,
not whitened, one basis for all rows of all tables.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from dreamdrive.evaluate import frechet_distance, half_distances
from dreamdrive_bench.common.keep import Features
from dreamdrive_bench.street.case import NOVEL

COMPONENTS = 64
"""Principal components that are kept, at most."""
SAMPLES_EACH = 4
"""True samples a component must have: halves, which floors are measured by, then have two."""
RESAMPLES = 400
TAIL = 0.025
"""Share of the resamples beyond each end of an interval."""
SPLITS = 40
"""Random halvings that a floor is the mean of."""
RESAMPLE_SPLITS = 2
"""The same in each resample."""
REAL = "truth"
"""Name of the real set beside the representations."""

Worlds = dict[int, Features]
Clips = list[Float[np.ndarray, "n d"]]
Row = dict[str, Any]


@dataclass(frozen=True)
class Basis:
    """Where the features of a network are measured."""

    mean: Float[np.ndarray, " d"]
    axes: Float[np.ndarray, "d k"]

    def project(self, rows: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n k"]:
        """Coordinates along the components."""
        return (rows.astype(np.float64) - self.mean) @ self.axes


def networks_of(truth: Worlds) -> list[str]:
    """Names of the distances whose features are there."""
    return sorted({name.split("/")[0] for found in truth.values() for name in found})


def bases_of(truth: Worlds) -> dict[str, Basis]:
    """The basis of each network, from the true novel views of all worlds."""
    worlds = {name: [pooled(found, name) for found in truth.values()] for name in networks_of(truth)}
    return {name: principal(np.concatenate([r for r in rows if len(r)])) for name, rows in worlds.items()}


def principal(rows: Float[np.ndarray, "n d"]) -> Basis:
    """The leading principal components."""
    rows = rows.astype(np.float64)
    mean = rows.mean(axis=0)
    count = max(1, min(COMPONENTS, rows.shape[1], len(rows) // SAMPLES_EACH))
    axes = np.linalg.svd(rows - mean, full_matrices=False)[2][:count].T
    return Basis(mean, axes)


def pooled(features: Features, network: str) -> Float[np.ndarray, "n d"]:
    """All novel views of a world together: frames of image networks, windows of video networks."""
    there = [features[key] for view in NOVEL if (key := f"{network}/{view}") in features]
    return np.concatenate(there) if there else np.zeros((0, 0))


def distance_rows(ours: str, fits: dict[str, Worlds], truth: Worlds, bases: dict[str, Basis]) -> list[Row]:
    """For each network and representation the distance, its floor, and ours as a share of it.

    Args:
        ours: The representation that the others are compared with.
        fits: By representation, features of the worlds that it was fitted to.
        truth: Features of the truth by world.
        bases: By network.
    """
    if ours not in fits:
        return []
    worlds = sorted(set.intersection(*(set(found) for found in fits.values())) & set(truth))
    if not worlds:
        return []
    rows: list[Row] = []
    for network, basis in bases.items():
        there = [seed for seed in worlds if len(pooled(truth[seed], network))]
        if not there:
            continue
        real = [pooled(truth[seed], network) for seed in there]
        fake = {name: [pooled(found[seed], network) for seed in there] for name, found in fits.items()}
        shown = {name: [basis.project(clip) for clip in clips] for name, clips in fake.items()}
        rows += _projected(network, ours, [basis.project(clip) for clip in real], shown)
        rows += _in_all_dimensions(network, ours, real, fake)
    return sorted(rows, key=lambda row: not row["projected"])


def _in_all_dimensions(network: str, ours: str, real: Clips, fake: dict[str, Clips]) -> list[Row]:
    """Values alone: an interval would take minutes a row."""
    truth, pools = np.concatenate(real), {name: np.concatenate(clips) for name, clips in fake.items()}
    rng = np.random.default_rng(0)
    floor, halves = half_distances(truth, tuple(pools.values()), frechet_distance, rng)
    half = dict(zip(pools, halves, strict=True))
    rows: list[Row] = []
    for name, rows_of in pools.items():
        whole = frechet_distance(truth, rows_of)
        row = _row(network, name, real, whole, half[name], floor, projected=False)
        rows.append(row if name == ours else row | _ratio(half[ours] - floor, half[name] - floor, None))
    return rows


def _projected(network: str, ours: str, real: Clips, fake: dict[str, Clips]) -> list[Row]:
    """With intervals over worlds, drawn for all representations at once."""
    rng = np.random.default_rng(0)
    sets = {REAL: real, **fake}
    value = by_halves(sets, np.ones((1, len(real))), SPLITS, rng)
    worlds = len(real)
    weights = np.stack(
        [np.bincount(rng.integers(0, worlds, worlds), minlength=worlds) for _ in range(RESAMPLES)]
    )
    drawn = by_halves(sets, weights, RESAMPLE_SPLITS, rng) if worlds > 1 else None
    rows: list[Row] = []
    for name in fake:
        whole, half, floor = value.whole[name][0], value.half[name][0], value.half[REAL][0]
        row = _row(network, name, real, whole, half, floor, projected=True)
        low, high = (None, None) if drawn is None else _interval(whole, drawn.whole[name])
        row |= {"low": low, "high": high}
        if name != ours:
            excess = value.half[ours][0] - floor
            row |= _ratio(excess, half - floor, None if drawn is None else drawn.ratios(ours, name))
        rows.append(row)
    return rows


def _row(
    network: str, name: str, real: Clips, value: float, half: float, floor: float, *, projected: bool
) -> Row:
    return {
        "network": network,
        "dimensions": real[0].shape[1],
        "projected": projected,
        "representation": name,
        "distance": float(value),
        "low": None,
        "high": None,
        "of_halves": float(half),
        "floor": float(floor),
        "samples": sum(map(len, real)),
    }


def _ratio(ours: float, theirs: float, drawn: Float[np.ndarray, " r"] | None) -> Row:
    """Excess of ours over the floor as a share of theirs; undecided if its interval holds 1 or is not known.

    It means nothing where theirs is no further from the truth than the truth from itself.
    """
    if theirs <= 0:
        return {"ours_over_this": None, "ratio_low": None, "ratio_high": None, "undecided": True}
    value = float(ours / theirs)
    # As drawn: moved onto the value, an interval would leave out a 1 that the resamples hold.
    low, high = (None, None) if drawn is None else _bounds(drawn)
    undecided = low is None or high is None or low <= 1 <= high
    return {"ours_over_this": value, "ratio_low": low, "ratio_high": high, "undecided": undecided}


def _bounds(drawn: Float[np.ndarray, " r"]) -> tuple[float, float] | tuple[None, None]:
    """Quantiles of what was drawn, not interpolated, as some may be infinite; None if the upper one is."""
    low, high = np.quantile(drawn, [TAIL, 1 - TAIL], method="inverted_cdf")
    return (float(low), float(high)) if np.isfinite(high) else (None, None)


def _interval(value: float, drawn: Float[np.ndarray, " r"]) -> tuple[float, float]:
    """Quantiles of what was drawn, moved so that their middle is the value: duplicates raise a distance."""
    low, middle, high = np.quantile(drawn, [TAIL, 0.5, 1 - TAIL])
    return float(value + low - middle), float(value + high - middle)


@dataclass(frozen=True)
class Halves:
    """Distances of sets from the real one, a value for each draw of worlds.

    Attributes:
        whole: Of all samples.
        half: Of one half of the real samples from the other half of the set: of the real one the floor.
    """

    whole: dict[str, Float[np.ndarray, " r"]]
    half: dict[str, Float[np.ndarray, " r"]]

    def ratios(self, ours: str, theirs: str) -> Float[np.ndarray, " r"] | None:
        """Excess of one over the floor as a share of another's, of each draw.

        Infinite in a draw in which the other has none; None where that is so often that the ratio has no
        bounds.
        """
        floor = self.half[REAL]
        excess = self.half[theirs] - floor
        if np.quantile(excess, TAIL) <= 0:
            return None
        return np.where(excess > 0, (self.half[ours] - floor) / np.where(excess > 0, excess, 1), np.inf)


def by_halves(
    sets: dict[str, Clips], weights: Float[np.ndarray, "r c"], splits: int, rng: np.random.Generator
) -> Halves:
    """Distances when each clip counts as often as its weight says.

    Each clip is halved at random, alike in all sets, and a clip that counts twice gives both halves twice.
    Moments add up, so that no sample is looked at again for a draw.
    """
    chosen = [_random_halves(len(clip), splits, rng) for clip in sets[REAL]]
    moments = {name: _Moments.of(clips, chosen).drawn(weights) for name, clips in sets.items()}
    here = moments[REAL].at(0)
    root, all_root = _root(here.covariance), _root(moments[REAL].whole.covariance)
    half = {name: _distance(here, root, found.at(1)).mean(axis=1) for name, found in moments.items()}
    real = moments[REAL].whole
    whole = {name: _distance(real, all_root, found.whole)[:, 0] for name, found in moments.items()}
    return Halves(whole, half)


def _random_halves(count: int, splits: int, rng: np.random.Generator) -> Float[np.ndarray, "s n"]:
    """1 for the first half of the samples, 0 for the second, of each split."""
    return np.stack([rng.permutation(count) < count // 2 for _ in range(splits)]).astype(np.float64)


@dataclass(frozen=True)
class _Moments:
    """Number, sum and sum of products of the samples; leading axes: clip or draw, split, half."""

    count: Float[np.ndarray, "r s h"]
    total: Float[np.ndarray, "r s h d"]
    square: Float[np.ndarray, "r s h d d"]

    @staticmethod
    def of(clips: Clips, chosen: list[Float[np.ndarray, "s n"]]) -> "_Moments":
        parts = [np.stack([first, 1 - first], axis=1) for first in chosen]
        pairs = list(zip(parts, clips, strict=True))
        count = np.stack([part.sum(axis=2) for part in parts])
        total = np.stack([part @ clip for part, clip in pairs])
        square = np.stack([(part[..., None] * clip).swapaxes(-1, -2) @ clip for part, clip in pairs])
        return _Moments(count, total, square)

    def drawn(self, weights: Float[np.ndarray, "r c"]) -> "_Moments":
        sums = (np.tensordot(weights, values, 1) for values in (self.count, self.total, self.square))
        return _Moments(*sums)

    def at(self, half: int) -> "_Moments":
        return _Moments(self.count[:, :, half], self.total[:, :, half], self.square[:, :, half])

    @property
    def whole(self) -> "_Moments":
        """Both halves of the first split."""
        first = (values[:, :1].sum(axis=2) for values in (self.count, self.total, self.square))
        return _Moments(*first)

    @property
    def mean(self) -> Float[np.ndarray, "*s d"]:
        return self.total / self.count[..., None]

    @property
    def covariance(self) -> Float[np.ndarray, "*s d d"]:
        outer = self.total[..., :, None] * self.mean[..., None, :]
        return (self.square - outer) / (self.count - 1)[..., None, None]


def _root(covariance: Float[np.ndarray, "*s d d"]) -> Float[np.ndarray, "*s d d"]:
    values, vectors = np.linalg.eigh(covariance)
    return (vectors * np.sqrt(np.maximum(values, 0))[..., None, :]) @ vectors.swapaxes(-1, -2)


def _distance(a: _Moments, root: Float[np.ndarray, "*s d d"], b: _Moments) -> Float[np.ndarray, "*s"]:
    """Squared Fréchet distance; ``root`` is that of the covariance of ``a``."""
    other = b.covariance
    spread = np.trace(a.covariance + other, axis1=-2, axis2=-1)
    product = np.linalg.eigvalsh(root @ other @ root)
    return np.square(a.mean - b.mean).sum(-1) + spread - 2 * np.sqrt(np.maximum(product, 0)).sum(-1)


def compared(rows: Sequence[Row]) -> list[Row]:
    """Of each network the rows that the claim is about: the best other, and static."""
    found: list[Row] = []
    for key in dict.fromkeys((row["network"], row["projected"]) for row in rows):
        others = [
            row for row in rows if (row["network"], row["projected"]) == key and "ours_over_this" in row
        ]
        if not others:
            continue
        best = min(others, key=lambda row: row["distance"])
        found.append({"against": "best other", **best})
        found += [{"against": "static", **row} for row in others if row["representation"] == "static"]
    return found
