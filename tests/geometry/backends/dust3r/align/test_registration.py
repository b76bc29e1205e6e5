"""Weighted similarities between point sets."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dreamdrive.geometry.backends.dust3r.align.registration import register

TURN = Rotation.from_rotvec([0.4, -1.1, 0.3]).as_matrix()


@pytest.mark.parametrize("flat", [False, True])
def test_a_similarity_is_found_back(flat: bool) -> None:
    x = np.random.default_rng(0).normal(size=(50, 3))
    x[:, 2] *= not flat  # points of a plane fit a mirrored rotation as well
    found = register(x, 2.5 * x @ TURN.T + [1.0, -2.0, 3.0], np.ones(50))
    assert found.scale == pytest.approx(2.5)
    np.testing.assert_allclose(found.rotation, TURN, atol=1e-12)
    np.testing.assert_allclose(found.translation, [1, -2, 3], atol=1e-12)
    assert np.linalg.det(found.rotation) > 0


def test_it_is_the_least_of_the_weighted_squares() -> None:
    random = np.random.default_rng(1)
    x, weights = random.normal(size=(40, 3)), random.uniform(0.1, 3, 40)
    y = 0.7 * x @ TURN.T + 0.3 * random.normal(size=(40, 3))
    found = register(x, y, weights)

    def cost(scale: float, rotation: np.ndarray, translation: np.ndarray) -> float:
        return float((weights * np.square(scale * x @ rotation.T + translation - y).sum(axis=1)).sum())

    best = cost(found.scale, found.rotation, found.translation)
    for axis in range(3):
        for sign in (-1e-4, 1e-4):
            tilt = Rotation.from_rotvec(sign * np.eye(3)[axis]).as_matrix()
            assert cost(found.scale, tilt @ found.rotation, found.translation) > best
            assert cost(found.scale, found.rotation, found.translation + sign * np.eye(3)[axis]) > best
            assert cost(found.scale + sign, found.rotation, found.translation) > best


def test_robust_steps_withstand_outliers_and_weights_of_zero_are_absent() -> None:
    random = np.random.default_rng(2)
    x = random.normal(size=(200, 3))
    y = 1.5 * x @ TURN.T + 1e-3 * random.normal(size=(200, 3))
    y[:40] += 5 * random.normal(size=(40, 3))
    assert abs(register(x, y, np.ones(200)).scale / 1.5 - 1) > 0.01
    assert abs(register(x, y, np.ones(200), robust_steps=20).scale / 1.5 - 1) < 1e-3
    x[:40] = np.nan
    weights = np.ones(200)
    weights[:40] = 0
    assert abs(register(x, y, weights).scale / 1.5 - 1) < 1e-3


def test_two_points_are_too_few() -> None:
    with pytest.raises(ValueError, match="2 weighted points"):
        register(np.zeros((4, 3)), np.zeros((4, 3)), np.array([1.0, 1.0, 0.0, 0.0]))
