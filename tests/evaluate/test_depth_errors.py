"""Errors of depth have their textbook values, and do not depend on the order of the pixels."""

import math
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.evaluate.geometry import SHARES, depth_errors, median_scale, trust

depths = st.lists(st.tuples(st.floats(0.5, 80), st.floats(0.5, 80), st.floats(0, 1)), min_size=2, max_size=40)


def test_a_known_scale_error_gives_the_textbook_values() -> None:
    true = np.array([5.0, 10.0, 40.0])
    errors = depth_errors(1.1 * true, true)
    assert errors is not None
    assert errors.pixels == 3
    assert errors.abs_rel == pytest.approx(0.1)
    assert errors.sq_rel_m == pytest.approx(0.01 * true.mean())
    assert errors.rmse_m == pytest.approx(0.1 * math.sqrt((25 + 100 + 1600) / 3))
    assert errors.rmse_log == pytest.approx(math.log(1.1))
    assert (errors.delta_1, errors.delta_2, errors.delta_3) == (1, 1, 1)


@pytest.mark.parametrize("way", [1, -1])
def test_a_ratio_at_the_limit_does_not_count(way: int) -> None:
    limits = 1.25 ** np.array([1.0, 2, 3])
    for shift, expected in ((0.0, (0, 1 / 3, 2 / 3)), (-1e-9, (1 / 3, 2 / 3, 1))):
        ratio = limits * (1 + shift)
        pair = (ratio, np.ones(3)) if way > 0 else (np.ones(3), ratio)
        errors = depth_errors(*pair)
        assert errors is not None
        assert (errors.delta_1, errors.delta_2, errors.delta_3) == pytest.approx(expected)


def test_no_pixels_have_no_errors() -> None:
    none = np.zeros(0)
    assert depth_errors(none, none) is None
    assert median_scale(none, none) is None
    assert trust(none, none, none) is None


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_pixels_without_depth_have_to_be_left_out(bad: float) -> None:
    with pytest.raises(ValueError, match="leave out pixels without depth"):
        depth_errors(np.array([1.0, bad]), np.ones(2))


def test_one_wild_pixel_does_not_move_the_median_scale() -> None:
    true = np.array([4.0, 8.0, 16.0, 32.0, 64.0])
    found = true / 1.5
    found[0] = 1000
    assert median_scale(found, true) == pytest.approx(1.5)


def test_confidence_that_knows_the_errors_is_told_from_one_that_misleads() -> None:
    true = np.full(8, 10.0)
    found = true * (1 + 0.1 * np.arange(8))
    good, bad = (trust(found, true, c) for c in (np.linspace(1, 0, 8), np.linspace(0, 1, 8)))
    assert good is not None
    assert bad is not None
    assert good.shares == SHARES
    assert good.abs_rel == pytest.approx((0.05, 0.15, 0.25, 0.35))
    assert bad.abs_rel == pytest.approx((0.65, 0.55, 0.45, 0.35))
    assert (good.rank_correlation, bad.rank_correlation) == pytest.approx((1, -1))


def test_equal_confidence_counts_with_its_mean_and_has_no_correlation() -> None:
    true, found = np.full(4, 10.0), np.array([10.0, 11, 12, 13])
    same = trust(found, true, np.full(4, 0.3))
    assert same is not None
    assert same.abs_rel == pytest.approx((0.15,) * 4)
    assert same.rank_correlation is None
    # Two levels of two pixels: a quarter takes half of the upper level, at its mean.
    two = trust(found, true, np.array([1.0, 1, 0, 0]))
    assert two is not None
    assert two.abs_rel == pytest.approx((0.05, 0.05, (0.1 + 0.25) / 3, 0.15))


@settings(max_examples=40)
@given(depths, st.randoms(use_true_random=False), st.sampled_from([0.25, 2.0, 8.0]))
def test_order_and_common_unit_do_not_matter(
    pixels: list[tuple[float, float, float]], random: Random, unit: float
) -> None:
    found, true, sure = np.array(pixels).T
    # Powers of two keep equal errors equal to the last bit, and with them the ranks.
    order = np.array(random.sample(range(len(true)), len(true)))
    one, other = (
        (depth_errors(*p), median_scale(*p))
        for p in ((found, true), (unit * found[order], unit * true[order]))
    )
    assert one[0] is not None
    assert other[0] is not None
    for name, power in (("abs_rel", 0), ("rmse_log", 0), ("sq_rel_m", 1), ("rmse_m", 1)):
        assert getattr(other[0], name) == pytest.approx(unit**power * getattr(one[0], name), abs=1e-9)
    assert other[1] == pytest.approx(one[1])
    a, b = trust(found, true, sure), trust(found[order], true[order], sure[order])
    assert a is not None
    assert b is not None
    assert b.abs_rel == pytest.approx(a.abs_rel)
    assert a.abs_rel[-1] == pytest.approx(one[0].abs_rel)
    assert b.rank_correlation == pytest.approx(a.rank_correlation)
    assert a.rank_correlation is None or -1 - 1e-9 <= a.rank_correlation <= 1 + 1e-9


@settings(max_examples=40)
@given(depths, st.floats(0.1, 10))
def test_the_median_scale_takes_any_scale_out(
    pixels: list[tuple[float, float, float]], factor: float
) -> None:
    found, true, _ = np.array(pixels).T
    one, other = (depth_errors(median_scale(f, true) * f, true) for f in (found, factor * found))  # type: ignore[operator]
    assert one is not None
    assert other is not None
    assert other.abs_rel == pytest.approx(one.abs_rel)
    assert other.rmse_m == pytest.approx(one.rmse_m)
