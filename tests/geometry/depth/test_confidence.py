"""Confidence from agreement between frames."""

import numpy as np

from dreamdrive.geometry.depth.confidence import (
    GROUND_PRIOR_CONFIDENCE,
    agreement,
    combine,
    temporal_neighbours,
)
from tests.geometry import toy


def test_neighbours_skip_what_may_not_be_used():
    usable = np.array([True, True, False, True, True, False, True])
    assert temporal_neighbours(usable, 3) == (0, 1, 4, 6)
    assert temporal_neighbours(usable, 0) == (1, 3)


def test_true_depth_agrees_and_wrong_depth_does_not():
    street = toy.drive([], count=5)
    inverse = np.where(street.depth_m > 0, 1 / np.maximum(street.depth_m, 0.1), 0).astype(np.float32)
    usable = np.ones(inverse.shape, bool)
    true = agreement(2, (0, 1, 3, 4), street.posed.cameras, inverse, usable)
    near = (street.depth_m[2] > 5) & (street.depth_m[2] < 30)
    assert true[near].mean() > 0.75
    wrong = inverse.copy()
    wrong[2] *= 1.5
    assert agreement(2, (0, 1, 3, 4), street.posed.cameras, wrong, usable)[near].mean() < 0.1


def test_a_standing_pair_proves_nothing():
    street = toy.drive([], count=3, step_m=0)
    inverse = np.full(street.depth_m.shape, 0.1, np.float32)
    assert agreement(1, (0, 2), street.posed.cameras, inverse, np.ones(inverse.shape, bool)).max() == 0


def test_the_ground_prior_has_a_constant_confidence_unless_supported():
    agreeing = np.array([[0.0, 1.0, 1.0]], np.float32)
    correlation = np.array([[0.0, 0.9, 0.0]], np.float32)
    on_plane = np.array([[True, True, False]])
    np.testing.assert_allclose(combine(agreeing, correlation, on_plane), [[GROUND_PRIOR_CONFIDENCE, 1, 0]])
