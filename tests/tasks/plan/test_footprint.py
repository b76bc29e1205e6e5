"""The ground that a car covers, and how it points."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan import AHEAD_RAD, CAR, Footprint, corners, headings
from tests.golden.reading import arrays
from tests.tasks.plan.golden import METRIC


def test_golden_headings_but_for_cars_that_hardly_move_or_go_back() -> None:
    given_ = arrays(METRIC)
    path = np.concatenate([np.zeros_like(given_["pred"][:, :1]), given_["pred"]], axis=1).astype(np.float64)
    way = np.concatenate([path[:, 2:], path[:, -1:]], axis=1) - path[:, :-1]
    steps = np.diff(np.concatenate([np.full((len(way), 1), AHEAD_RAD), given_["polygon_pred_yaw"]], axis=1))
    back = np.cumsum(np.cos(steps) < 0, axis=1) > 0
    plain = (np.linalg.norm(way, axis=-1) > 0.5) & ~back
    assert plain.sum() > 200
    apart = headings(given_["pred"].astype(np.float64)) - given_["polygon_pred_yaw"]
    assert np.abs((apart + np.pi) % (2 * np.pi) - np.pi)[plain].max() < 1e-5


@given(st.floats(-0.9, 0.9), st.floats(0.5, 10))
def test_a_straight_path_points_along_itself(angle: float, step_m: float) -> None:
    direction = np.array([np.cos(AHEAD_RAD + angle), np.sin(AHEAD_RAD + angle)])
    path = step_m * np.arange(1, 7)[:, None] * direction
    np.testing.assert_allclose(headings(path), AHEAD_RAD + angle, atol=1e-9)
    np.testing.assert_allclose(headings(-path), AHEAD_RAD + angle, atol=1e-9)


def test_a_car_that_stands_points_ahead_whatever_its_waypoints_shiver() -> None:
    path = np.random.default_rng(0).normal(0, 0.01, (4, 6, 2))
    assert (headings(path) == AHEAD_RAD).all()


def test_a_car_that_stops_keeps_its_heading() -> None:
    path = np.cumsum([[0, 3], [1, 3], [2, 2], [0, 0], [-0.01, 0], [0.01, 0]], axis=0).astype(float)
    found = headings(path)
    assert found[2] == pytest.approx(np.arctan2(2, 2))
    assert (found[3:] == found[2]).all()


def test_the_rectangle_lies_ahead_of_the_waypoint() -> None:
    box = CAR.along(np.array([[0.0, 5.0], [0.0, 10.0]]))[0]
    np.testing.assert_allclose(box, [0, 5.5, 4.084, 1.85, AHEAD_RAD], atol=1e-12)
    assert corners(box)[:, 1].max() == pytest.approx(5 + 2.542)
    assert corners(box)[:, 1].min() == pytest.approx(5 - 1.542)
    np.testing.assert_allclose(CAR.along(np.array([[0.0, 5.0]]), 0.3)[0, 2:4], [4.684, 2.45])


def test_no_car_is_refused() -> None:
    with pytest.raises(InputError, match="is no car"):
        Footprint(length_m=0.0)
