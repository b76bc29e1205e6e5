"""Principal components of features."""

import numpy as np
import pytest

from dreamdrive.prior.pca import reduce


def features(frames: int = 3, scale: float = 1.0) -> list[np.ndarray]:
    """Two hidden patterns in five channels, one of them five times as strong, and some noise."""
    draw = np.random.default_rng(0)
    hidden = draw.normal(size=(frames, 6, 8, 2)) * (5.0, 1.0)
    mix = np.linalg.qr(draw.normal(size=(5, 2)))[0].T
    return list(scale * (hidden @ mix + 1e-3 * draw.normal(size=(frames, 6, 8, 5)) + 7.0))


def test_the_patterns_come_out_strongest_first() -> None:
    given = features()
    made = reduce(given, 3)
    assert made.dtype == np.float16
    assert made.shape == (3, 6, 8, 3)
    flat = made.reshape(-1, 3).astype(np.float64)
    np.testing.assert_allclose(flat.mean(axis=0), 0, atol=1e-3)
    np.testing.assert_allclose(flat.std(axis=0), [1, 0.2, 0], atol=0.03)
    # As the singular value decomposition has it, but for signs.
    whole = np.concatenate([each.reshape(-1, 5) for each in given])
    left = np.linalg.svd(whole - whole.mean(axis=0), full_matrices=False)[0]
    assert abs(np.corrcoef(left[:, 0], flat[:, 0])[0, 1]) > 0.999
    assert abs(np.corrcoef(left[:, 1], flat[:, 1])[0, 1]) > 0.999


def test_neither_scale_nor_frames_change_signs() -> None:
    np.testing.assert_allclose(
        reduce(features(), 2), reduce(features(scale=-100.0)[::-1], 2)[::-1] * -1, atol=2e-3
    )


def test_features_without_variance_are_zero() -> None:
    assert not reduce([np.ones((2, 2, 3), np.float16)] * 2, 2).any()


def test_at_most_what_there_is() -> None:
    assert reduce(features(), 9).shape[-1] == 5
    with pytest.raises(ValueError, match="cannot keep 0 components of 3 frames"):
        reduce(features(), 0)
