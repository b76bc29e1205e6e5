"""One camera out of many estimates."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.street_network.cameras import camera_of, common_camera, weighted_median
from dreamdrive.street_network.resize import ResizePad


def said(focal: float, spread: float = 0.1, horizon: float = 0.0) -> np.ndarray:
    return np.array([np.log(focal), horizon, 0.01, np.log(spread), np.log(0.02), np.log(0.01), -2])


def test_a_few_wrong_frames_do_not_move_the_common_camera() -> None:
    resize = ResizePad.choose(480, 270, 480)
    answers = [said(0.9)] * 7 + [said(2.0)] * 3
    camera = common_camera(tuple(camera_of(answer, resize) for answer in answers))
    assert camera.focal_px == pytest.approx(0.9 * 480)
    assert camera.focal_spread == pytest.approx(0.1)


def test_sure_frames_outweigh_unsure_ones() -> None:
    resize = ResizePad.choose(480, 270, 480)
    answers = [said(0.9, 0.05)] * 3 + [said(1.5, 0.5)] * 7
    camera = common_camera(tuple(camera_of(answer, resize) for answer in answers))
    assert camera.focal_px == pytest.approx(0.9 * 480)


def test_pitch_follows_from_the_horizon() -> None:
    resize = ResizePad.choose(480, 288, 480)
    camera = camera_of(said(1.0, horizon=0.1), resize)
    assert camera.pitch_rad == pytest.approx(np.arctan(0.1 * np.cos(0.01)))
    assert camera.hfov_rad == pytest.approx(2 * np.arctan(0.5))
    middle, right = camera.horizon_rows(np.array([240.0, 480.0]))
    assert middle == pytest.approx(144 + 48)
    assert right < middle  # turned clockwise, the right of the picture is lower in the street


@given(st.lists(st.floats(-5, 5), min_size=1, max_size=9))
def test_with_equal_weights_it_is_the_median(values: list[float]) -> None:
    assert weighted_median(np.array(values), np.ones(len(values))) == pytest.approx(np.median(values))
