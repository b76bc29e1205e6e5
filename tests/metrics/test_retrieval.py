"""Intersection over union, precision, recall, average precision: by hand."""

import numpy as np
import pytest

from dreamdrive.metrics.retrieval import retrieval


def test_the_figures_of_a_small_example() -> None:
    true = np.array([[True, False, True], [True, False, False]])
    score = np.array([[0.9, 0.8, 0.7], [0.2, 0.1, 0.5]])
    found = retrieval(true, score)
    assert (found.true, found.count) == (3, 6)
    assert (found.iou, found.precision) == (2 / 5, 2 / 4)
    assert found.recall == pytest.approx(2 / 3)
    # In order of the scores: true, false, true, false, true, false.
    assert found.average_precision == pytest.approx((1 + 2 / 3 + 3 / 5) / 3)


def test_equal_scores_have_no_order() -> None:
    for true in ([True, False, False, True], [False, True, True, False]):
        assert retrieval(np.array(true), np.full(4, 0.3)).average_precision == 0.5


def test_what_has_no_meaning_is_none() -> None:
    nothing = retrieval(np.zeros(4, dtype=bool), np.zeros(4))
    assert (nothing.iou, nothing.precision, nothing.recall, nothing.average_precision) == (None,) * 4
    wrong = retrieval(np.zeros(4, dtype=bool), np.ones(4))
    assert (wrong.iou, wrong.precision, wrong.recall) == (0.0, 0.0, None)
    missed = retrieval(np.ones(4, dtype=bool), np.zeros(4))
    assert (missed.iou, missed.precision, missed.recall) == (0.0, None, 0.0)
