"""Distances between two sets of features: Fréchet (FID, FVD) and kernel (KID, KVD)."""

from functools import reduce
from typing import get_args

import numpy as np
from jaxtyping import Float

from dreamdrive.errors import InputError
from dreamdrive.names import Covariance

KERNEL_SUBSETS = 100
KERNEL_SUBSET_SIZE = 1000


def frechet_distance(
    real: Float[np.ndarray, "n d"], fake: Float[np.ndarray, "m d"], covariance: Covariance = "sample"
) -> float:
    """Squared Fréchet distance of the Gaussians with the moments of two sets (Heusel et al. 2017, eq. 6).

    Covariances are divided by N - 1, as most programs do, or by N (``population``), as StyleGAN-V and cd-fvd
    do. Exact for rank-deficient ones and never complex. Depends strongly on the number of samples, a row
    each: only distances of equal counts may be compared. Identical sets give 0 up to rounding, perhaps less.

    Raises:
        InputError: Fewer than two samples, or features that are not finite.
    """
    if covariance not in get_args(Covariance):
        raise ValueError(f"covariance {covariance!r}: expected one of {get_args(Covariance)}")
    a, b = _checked(real, fake)
    missing = 1 if covariance == "sample" else 0
    shift = a.mean(axis=0) - b.mean(axis=0)
    a = (a - a.mean(axis=0)) / np.sqrt(len(a) - missing)
    b = (b - b.mean(axis=0)) / np.sqrt(len(b) - missing)
    spread = np.sum(a * a) + np.sum(b * b)
    return float(shift @ shift + spread - 2 * _root_trace(a, b))


def _root_trace(a: Float[np.ndarray, "n d"], b: Float[np.ndarray, "m d"]) -> float:
    """Trace of the square root of the product of the covariances ``a.T @ a`` and ``b.T @ b``.

    That is the nuclear norm of ``a @ b.T``; of the many ways to compute it the cheapest is taken.
    """
    if max(len(a), len(b)) < a.shape[1]:
        return float(np.linalg.svd(a @ b.T, compute_uv=False).sum())
    values, vectors = np.linalg.eigh(a.T @ a)
    root = (vectors * np.sqrt(np.maximum(values, 0))) @ vectors.T
    product = np.linalg.eigvalsh(root @ (b.T @ b) @ root)
    return float(np.sqrt(np.maximum(product, 0)).sum())


def polynomial_mmd(
    real: Float[np.ndarray, "n d"],
    fake: Float[np.ndarray, "m d"],
    *,
    degree: int = 3,
    offset: float = 1.0,
    unbiased: bool = True,
) -> float:
    """Squared maximum mean discrepancy of samples, a row each, under the kernel (x.y / d + offset)^degree.

    The defaults are those of KID (Binkowski et al. 2018); unbiased, without the similarity of each sample to
    itself, its expectation does not depend on the number of samples, and it may be slightly negative.
    ``degree=2, offset=0, unbiased=False`` is that of JEDi (Luo et al. 2024), without its factor of 100.
    """
    a, b = _checked(real, fake)

    def kernel(x: Float[np.ndarray, "i d"], y: Float[np.ndarray, "j d"]) -> Float[np.ndarray, "i j"]:
        base = x @ y.T / x.shape[1] + offset
        return reduce(np.multiply, [base] * degree)  # fifty times as fast as a power

    def within(x: Float[np.ndarray, "i d"]) -> float:
        similarity, count = kernel(x, x), len(x)
        if unbiased:
            return float((similarity.sum() - np.trace(similarity)) / (count * (count - 1)))
        return float(similarity.mean())

    return within(a) + within(b) - 2 * float(kernel(a, b).mean())


def kernel_distance(
    real: Float[np.ndarray, "n d"], fake: Float[np.ndarray, "m d"], *, seed: int = 0
) -> float:
    """KID or KVD: ``polynomial_mmd`` of all samples, beyond 1000 its mean over 100 random subsets of 1000."""
    if max(len(real), len(fake)) <= KERNEL_SUBSET_SIZE:
        return polynomial_mmd(real, fake)
    rng = np.random.default_rng(seed)
    size = min(KERNEL_SUBSET_SIZE, len(real), len(fake))

    def subset(features: Float[np.ndarray, "k d"]) -> Float[np.ndarray, "s d"]:
        return features[rng.choice(len(features), size, replace=False)]

    values = [polynomial_mmd(subset(real), subset(fake)) for _ in range(KERNEL_SUBSETS)]
    return float(np.mean(values))


def _checked(
    real: Float[np.ndarray, "n d"], fake: Float[np.ndarray, "m d"]
) -> tuple[Float[np.ndarray, "n d"], Float[np.ndarray, "m d"]]:
    for name, features in (("real", real), ("fake", fake)):
        if len(features) < 2:
            raise InputError(
                f"the {name} set has {len(features)} samples; a distance of distributions needs at least 2: "
                "give more frames or clips"
            )
        if not np.isfinite(features).all():
            raise InputError(f"features of the {name} set are NaN or infinite; are these the right weights?")
    return np.asarray(real, np.float64), np.asarray(fake, np.float64)
