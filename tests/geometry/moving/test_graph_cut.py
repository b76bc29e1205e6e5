"""The minimum cut against all labellings of small pictures."""

from itertools import product

import numpy as np
from hypothesis import given, settings, strategies as st

from dreamdrive.geometry.moving.outline import minimum_cut

ROWS, COLUMNS = 3, 3
ALL = np.array(list(product([False, True], repeat=ROWS * COLUMNS))).reshape(-1, ROWS, COLUMNS)


def value(labels: np.ndarray, gain: np.ndarray, right: np.ndarray, below: np.ndarray) -> np.ndarray:
    """What each labelling (n, H, W) is worth."""
    across = ((labels[:, :, 1:] != labels[:, :, :-1]) * right).sum(axis=(1, 2))
    down = ((labels[:, 1:] != labels[:, :-1]) * below).sum(axis=(1, 2))
    return (labels * gain).sum(axis=(1, 2)) - across - down


@settings(max_examples=60)
@given(st.integers(0, 2**31))
def test_no_labelling_is_better_and_none_as_good_is_smaller(seed):
    rng = np.random.default_rng(seed)
    gain = rng.integers(-20, 21, (ROWS, COLUMNS)) / 4
    right = rng.integers(0, 13, (ROWS, COLUMNS - 1)) / 4
    below = rng.integers(0, 13, (ROWS - 1, COLUMNS)) / 4
    labels = minimum_cut(gain, right, below)
    values = value(ALL, gain, right, below)
    assert value(labels[None], gain, right, below)[0] == values.max()
    assert labels.sum() == ALL[values == values.max()].sum(axis=(1, 2)).min()


def test_a_plain_patch_goes_with_the_side_it_has_no_edge_to():
    gain = np.zeros((5, 12))
    gain[:, 0], gain[:, -1] = 5, -5
    right = np.full((5, 11), 3.0)
    right[:, 7] = 0.1
    labels = minimum_cut(gain, right, np.full((4, 12), 3.0))
    assert labels[:, :8].all()
    assert not labels[:, 8:].any()


def test_without_gain_nothing_is_labelled():
    assert not minimum_cut(np.zeros((4, 5)), np.ones((4, 4)), np.ones((3, 5))).any()
