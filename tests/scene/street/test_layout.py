"""Tracks of a layout."""

import numpy as np
from hypothesis import given, strategies as st

from dreamdrive.scene.street.layout import TrackPoint, is_moving, track_function

places = st.floats(-100, 100)


@given(st.lists(st.tuples(places, places, st.floats(-3, 3)), min_size=1, max_size=6))
def test_a_track_meets_its_points_and_goes_on_evenly(values: list[tuple[float, float, float]]) -> None:
    track = [TrackPoint(0.5 * k, *value) for k, value in enumerate(values)]
    poses = track_function(track)
    times = np.array([point.t_s for point in track])
    found = poses(times)
    np.testing.assert_allclose(found[:, :2], np.array(values)[:, :2], atol=1e-9)
    np.testing.assert_allclose(np.cos(found[:, 2] - np.array(values)[:, 2]), 1, atol=1e-9)
    after = poses(times[-1] + np.array([0.0, 1.0, 2.0]))
    np.testing.assert_allclose(after[2] - after[1], after[1] - after[0], atol=1e-9)


def test_headings_turn_the_short_way() -> None:
    track = [TrackPoint(0, 0, 0, 3.1), TrackPoint(1, 1, 0, -3.1)]
    assert abs(track_function(track)(np.array([0.5]))[0, 2]) > 3.1


def test_what_hardly_moves_stands() -> None:
    assert not is_moving([TrackPoint(0, 1, 2, 0)])
    assert not is_moving([TrackPoint(0, 1, 2, 0), TrackPoint(1, 1.04, 2, 0.01)])
    assert is_moving([TrackPoint(0, 1, 2, 0), TrackPoint(1, 1.2, 2, 0)])
    assert is_moving([TrackPoint(0, 1, 2, 0), TrackPoint(1, 1, 2, 0.2)])
