"""The size of pictures."""

import pytest

from dreamdrive.view.page.pace import LEAST_PX, MOVING_PX, RESTING_PX, PictureSize


@pytest.mark.parametrize("window", [(1280, 720), (2560, 1440), (500, 900), (300, 200), (0, 0), (5000, 1)])
def test_a_picture_has_the_windows_shape_and_no_more_pixels_than_allowed(window: tuple[int, int]) -> None:
    pace = PictureSize()
    for resting, most in ((False, MOVING_PX), (True, RESTING_PX)):
        width, height = pace.size(window, resting)
        assert 2 <= width <= max(2, window[0])
        assert 2 <= height <= max(2, window[1])
        assert width * height <= max(most, 2 * window[0])
    if min(window) > 100:
        width, height = pace.size(window, False)
        assert width / height == pytest.approx(window[0] / window[1], rel=0.02)


def test_slow_pictures_become_smaller_and_quick_ones_larger_again() -> None:
    pace = PictureSize()
    assert pace.size((1280, 720), False) == (480, 270)
    for _ in range(20):
        pace.took(0.5)
    width, height = pace.size((1280, 720), False)
    assert width * height <= LEAST_PX
    assert pace.size((1280, 720), True) == (1280, 720)
    pace.took(0.05)  # neither slow nor quick
    assert pace.size((1280, 720), False) == (width, height)
    for _ in range(20):
        pace.took(0.01)
    assert pace.size((1280, 720), False) == (480, 270)
