"""How far depth is off, pixel by pixel, and whether the confidence knows it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import rankdata

SHARES = (0.25, 0.5, 0.75, 1.0)
"""Shares of the pixels, the most trusted first, over which the error is averaged."""
_DELTA = 1.25


@dataclass(frozen=True)
class DepthErrors:
    """Means over pixels, by the definitions of Eigen et al. 2014; d is the depth found, t the true one.

    Attributes:
        pixels: Number of pixels.
        abs_rel: Mean of |d - t| / t.
        sq_rel_m: Mean of (d - t)^2 / t in metres.
        rmse_m: Root mean square of d - t in metres.
        rmse_log: Root mean square of ln d - ln t.
        delta_1: Share with max(d / t, t / d) below 1.25; a pixel at the limit does not count.
        delta_2: The same below 1.25^2.
        delta_3: The same below 1.25^3.
    """

    pixels: int
    abs_rel: float
    sq_rel_m: float
    rmse_m: float
    rmse_log: float
    delta_1: float
    delta_2: float
    delta_3: float


@dataclass(frozen=True)
class Trust:
    """Whether the most trusted pixels are the most right ones.

    Attributes:
        pixels: Number of pixels.
        shares: Shares of the pixels, the most trusted first.
        abs_rel: Mean of |d - t| / t over each share.
        rank_correlation: Spearman's, between the confidence and minus that error: 1 where the more trusted of
            two pixels is always the more right, 0 where confidence says nothing, below 0 where it misleads;
            None where either is the same in all pixels.
    """

    pixels: int
    shares: tuple[float, ...]
    abs_rel: tuple[float, ...]
    rank_correlation: float | None


def depth_errors(found: Float[np.ndarray, " n"], true: Float[np.ndarray, " n"]) -> DepthErrors | None:
    """The errors of positive depths (N,), both in metres; None for no pixels."""
    if not len(true):
        return None
    d, t = _positive(found), _positive(true)
    ratio, log = np.maximum(d / t, t / d), np.log(d) - np.log(t)
    return DepthErrors(
        pixels=len(t),
        abs_rel=float((np.abs(d - t) / t).mean()),
        sq_rel_m=float((np.square(d - t) / t).mean()),
        rmse_m=float(np.sqrt(np.square(d - t).mean())),
        rmse_log=float(np.sqrt(np.square(log).mean())),
        delta_1=float((ratio < _DELTA).mean()),
        delta_2=float((ratio < _DELTA**2).mean()),
        delta_3=float((ratio < _DELTA**3).mean()),
    )


def median_scale(found: Float[np.ndarray, " n"], true: Float[np.ndarray, " n"]) -> float | None:
    """The median of true depth over depth found, of positive depths (N,); None for no pixels."""
    return float(np.median(_positive(true) / _positive(found))) if len(true) else None


def trust(
    found: Float[np.ndarray, " n"], true: Float[np.ndarray, " n"], confidence: Float[np.ndarray, " n"]
) -> Trust | None:
    """Compare confidence with the errors of positive depths (N,); None for no pixels.

    Pixels of equal confidence count with their common mean error: which of them a share takes is no one's
    choice, and the order of the pixels does not matter.
    """
    if not len(true):
        return None
    error = np.abs(_positive(found) - _positive(true)) / _positive(true)
    _, level, count = np.unique(-confidence.astype(np.float64), return_inverse=True, return_counts=True)
    summed = np.concatenate([[0.0], np.cumsum(np.bincount(level, weights=error))])
    taken = np.concatenate([[0], np.cumsum(count)])
    wanted = np.array(SHARES) * len(error)
    means = np.interp(wanted, taken, summed) / wanted
    correlation = _rank_correlation(confidence, -error)
    return Trust(len(error), SHARES, tuple(means.tolist()), correlation)


def _positive(depth: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    if not (np.isfinite(depth) & (depth > 0)).all():
        raise ValueError("depth errors: expected positive, finite depths; leave out pixels without depth")
    return depth.astype(np.float64)


def _rank_correlation(a: Float[np.ndarray, " n"], b: Float[np.ndarray, " n"]) -> float | None:
    """Spearman's rank correlation, equal values at their mean rank."""
    if np.ptp(a) == 0 or np.ptp(b) == 0:
        return None
    return float(np.corrcoef(rankdata(a), rankdata(b))[0, 1])
