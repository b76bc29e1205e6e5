"""Distances of feature sets against public programs, and their edge cases."""

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.evaluate.clips import frechet
from dreamdrive.evaluate.clips.frechet import frechet_distance, kernel_distance, polynomial_mmd
from tests.golden.reading import arrays, cases, values

LIMIT = 1e-6
"""Of what is subtracted to get the distance, which is small beside it where sets are alike. All but LVDM's
programs compute in float64; theirs differ by this much where covariances have no full rank."""


@pytest.mark.parametrize("case", cases("eval/frechet.json"))
def test_golden_distances(case: str) -> None:
    sets, expected = arrays("eval/frechet.npz"), values("eval/frechet.json")[case]
    a, b = sets[f"{case}/a"].astype(np.float64), sets[f"{case}/b"].astype(np.float64)
    m = min(len(a), len(b))
    spread = sum(each.var(axis=0, ddof=1).sum() for each in (a, b))
    spread += np.square(a.mean(axis=0) - b.mean(axis=0)).sum()
    similar = np.mean([np.square(each).sum(axis=1).mean() / a.shape[1] for each in (a, b)])
    for got, name, size in (
        (frechet_distance(a, b), "reference symmetric eigh (unbiased)", spread),
        (frechet_distance(a, b, "population"), "reference symmetric eigh (biased)", spread),
        (frechet_distance(a, b), "torchmetrics", spread),
        (frechet_distance(a, b, "population"), "cd_fvd / stylegan_v metric_utils (biased cov)", spread),
        (polynomial_mmd(a[:m], b[:m]), "kid_torch_fidelity_first_m", (similar + 1) ** 3),
        (polynomial_mmd(a, b), "kvd_lvdm (deg 3, gamma 1/d, coef 1, all samples)", (similar + 1) ** 3),
        (
            polynomial_mmd(a, b, degree=2, offset=0, unbiased=False),
            "jedi_mmd_deg2_coef0_biased (x100 = JEDi)",
            similar**2,
        ),
    ):
        if isinstance(wanted := expected[name], float):  # else the error that the program ends with
            assert got == pytest.approx(wanted, rel=LIMIT, abs=LIMIT * size), name


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
