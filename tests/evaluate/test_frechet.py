"""Distances of feature sets against public programs, and their edge cases."""

import json
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.evaluate import frechet
from dreamdrive.evaluate.frechet import frechet_distance, kernel_distance, polynomial_mmd

CASES = (
    "full_rank_500x32",
    "identical",
    "mean_shift_only",
    "rank_deficient_20x64",
    "rank_deficient_24_vs_300x64",
    "few_2x16",
    "constant_feature_200x8",
    "one_dim_300x1",
    "inception_like_relu_256x128",
    "large_scale_logits_64x40",
)


@pytest.mark.parametrize("case", CASES)
def test_golden_distances(golden_dir: Path, case: str) -> None:
    arrays = np.load(golden_dir / "eval" / "frechet.npz")
    expected = json.loads((golden_dir / "eval" / "frechet.json").read_text())[case]
    a, b = arrays[f"{case}/a"], arrays[f"{case}/b"]
    m = min(len(a), len(b))
    for got, name in (
        (frechet_distance(a, b), "reference symmetric eigh (unbiased)"),
        (frechet_distance(a, b, "population"), "reference symmetric eigh (biased)"),
        (frechet_distance(a, b), "torchmetrics"),
        (frechet_distance(a, b, "population"), "cd_fvd / stylegan_v metric_utils (biased cov)"),
        (polynomial_mmd(a[:m], b[:m]), "kid_torch_fidelity_first_m"),
        (polynomial_mmd(a, b), "kvd_lvdm (deg 3, gamma 1/d, coef 1, all samples)"),
        (
            polynomial_mmd(a, b, degree=2, offset=0, unbiased=False),
            "jedi_mmd_deg2_coef0_biased (x100 = JEDi)",
        ),
    ):
        assert got == pytest.approx(expected[name], rel=1e-6, abs=1e-8), name


def test_both_routes_agree() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(20, 19)), rng.normal(1, 2, size=(20, 19))
    # A constant column changes no distance, but with two of them there are fewer samples than values.
    wide = [np.concatenate([x, np.ones((20, 2))], axis=1) for x in (a, b)]
    assert frechet_distance(*wide) == pytest.approx(frechet_distance(a, b), rel=1e-9)


def test_one_dimension_is_the_formula() -> None:
    x = np.random.default_rng(0).normal(size=(50, 1))
    y = 3 * x + 2
    expected = (y.mean() - x.mean()) ** 2 + (y.std(ddof=1) - x.std(ddof=1)) ** 2
    assert frechet_distance(x, y) == pytest.approx(expected)


def test_many_samples_are_compared_by_subsets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frechet, "KERNEL_SUBSET_SIZE", 100)
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(120, 4)), rng.normal(0.5, 1, size=(110, 4))
    assert kernel_distance(a, b) == pytest.approx(polynomial_mmd(a, b), rel=0.05)
    assert kernel_distance(a, b) == kernel_distance(a, b) != kernel_distance(a, b, seed=1)
    assert kernel_distance(a[:9], b[:7]) == polynomial_mmd(a[:9], b[:7])


@pytest.mark.parametrize("distance", [frechet_distance, polynomial_mmd])
def test_sets_that_have_no_distance(distance) -> None:
    good = np.random.default_rng(0).normal(size=(5, 3))
    with pytest.raises(InputError, match="the fake set has 1 samples"):
        distance(good, good[:1])
    with pytest.raises(InputError, match="features of the real set are NaN"):
        distance(good * np.nan, good)
