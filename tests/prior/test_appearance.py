import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.prior.appearance import NAMES, appearance
from tests.data.textures import texture


def clip(count: int = 3, size=(64, 48)) -> tuple[np.ndarray, np.ndarray]:
    frames = np.stack([texture(size[1], size[0], seed) for seed in range(count)])
    return frames, np.ones(frames.shape[:3], dtype=bool)


@settings(max_examples=10)
@given(st.integers(50, 90), st.integers(50, 90), st.integers(1, 3))
def test_every_channel_has_mean_0_and_variance_1(width, height, count):
    features = appearance(*clip(count, (2 * width, 2 * height)))
    assert features.shape == (count, height, width, len(NAMES))
    assert features.dtype == np.float16
    flat = features.astype(np.float64).reshape(-1, len(NAMES))
    np.testing.assert_allclose(flat.mean(axis=0), 0, atol=5e-3)
    np.testing.assert_allclose(flat.std(axis=0), 1, atol=2e-2)


def test_a_grey_clip_has_no_colour():
    frames, valid = clip()
    features = appearance(np.repeat(frames[..., :1], 3, axis=3), valid)
    colour = [name.split()[0] in "ab" for name in NAMES]
    assert (features[..., colour] == 0).all()
    assert (features[..., ~np.array(colour)] != 0).any(axis=(0, 1, 2)).all()


def test_a_clip_of_one_colour_has_no_features():
    frames = np.full((2, 48, 64, 3), 90, dtype=np.uint8)
    assert (appearance(frames, np.ones((2, 48, 64), bool)) == 0).all()


def test_invalid_pixels_leave_no_trace():
    """What they hold changes no feature, and they have none themselves."""
    frames, valid = clip()
    valid[:, :10, :21] = False
    dark, bright = frames.copy(), frames.copy()
    dark[~valid], bright[~valid] = 0, 255
    features = appearance(dark, valid)
    np.testing.assert_array_equal(features, appearance(bright, valid))
    assert (features[:, :5, :10] == 0).all()
    assert (features[:, :5, 10] != 0).any()


def test_an_edge_shows_in_gradient_and_contrast():
    frames = np.full((1, 48, 64, 3), 50, dtype=np.uint8)
    frames[:, :, 32:] = 200
    features = appearance(frames, np.ones((1, 48, 64), bool))[0].astype(float)
    for index, name in enumerate(NAMES):
        row = features[12, :, index]
        if name.startswith(("gradient", "contrast")):
            assert set(np.flatnonzero(row > row.max() - 1e-3)) <= {15, 16}
        elif name.startswith("L"):
            assert row[0] < 0 < row[-1]


def test_twice_the_same():
    frames, valid = clip()
    assert appearance(frames, valid).tobytes() == appearance(frames, valid).tobytes()


def test_odd_sizes_are_an_error():
    with pytest.raises(ValueError, match="even size, got 63x48"):
        appearance(np.zeros((1, 48, 63, 3), np.uint8), np.ones((1, 48, 63), bool))
