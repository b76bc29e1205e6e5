"""Windows keep their side up to a width and grow beyond it."""

import pytest
from hypothesis import given, strategies as st

from dreamdrive.vision.windows import grown, window_px


@given(st.integers(1, 15).map(lambda k: 2 * k + 1), st.integers(16, 480))
def test_windows_of_narrow_pictures_stay(side: int, width: int) -> None:
    assert window_px(side, width) == side


@given(st.integers(1, 15).map(lambda k: 2 * k + 1), st.integers(481, 8000))
def test_windows_of_wide_pictures_are_odd_and_cover_the_same_part(side: int, width: int) -> None:
    found = window_px(side, width)
    assert found % 2 == 1
    assert found == pytest.approx(grown(side, width), abs=1)
