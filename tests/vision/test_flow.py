import cv2
import numpy as np
import pytest

from dreamdrive.vision.flow import guided


def textured(seed: int, size: tuple[int, int]) -> np.ndarray:
    noise = np.random.default_rng(seed).uniform(0, 255, (size[1], size[0])).astype(np.float32)
    return cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 1.5), None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)


@pytest.mark.parametrize("shift_px", [(0.0, 0.0), (31.0, -12.5)])
@pytest.mark.parametrize("scale", [0.8, 1.0, 1.25])
def test_a_thing_that_grows_and_jumps_is_found_again(shift_px: tuple[float, float], scale: float) -> None:
    """In front of another background, expected three pixels beside where it is."""
    thing, shift = textured(0, (40, 30)), np.array(shift_px)
    first, second = textured(1, (160, 120)), textured(2, (160, 120))
    first[50:80, 60:100] = thing
    middle = np.array([80.0, 65.0])
    way = np.hstack([scale * np.eye(2), (middle + shift - scale * np.array([20, 15]))[:, None]])
    way[:, 2] += 0.5 * scale - 0.5  # OpenCV counts from the middle of the first pixel
    laid = cv2.warpAffine(thing, way, (160, 120), dst=second.copy(), borderMode=cv2.BORDER_TRANSPARENT)
    points = np.stack(np.meshgrid(np.arange(66.5, 96, 4), np.arange(56.5, 76, 4)), axis=-1).reshape(-1, 2)
    true = middle + shift + scale * (points - middle)
    found, trusted = guided(first, laid, points, true + np.array([2.0, -2.0]))
    off = np.linalg.norm(found - true, axis=1)
    assert trusted.mean() > 0.7
    assert np.median(off[trusted]) < 0.35
    assert (off[trusted] < 1.0).mean() > 0.9


def test_what_is_not_there_is_not_trusted() -> None:
    first, second = textured(1, (160, 120)), textured(2, (160, 120))
    points = np.stack(np.meshgrid(np.arange(60.5, 100, 4), np.arange(50.5, 80, 4)), axis=-1).reshape(-1, 2)
    assert guided(first, second, points, points)[1].mean() < 0.4


def test_a_thing_of_one_point_does_not_fail() -> None:
    first = textured(1, (160, 120))
    found, _ = guided(first, first, np.array([[80.5, 60.5]]), np.array([[80.5, 60.5]]))
    assert found == pytest.approx(np.array([[80.5, 60.5]]), abs=0.3)
