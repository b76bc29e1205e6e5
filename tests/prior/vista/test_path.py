"""A path as waypoints of Vista's rounds."""

import numpy as np
import pytest
from tests.prior.paths import circle

from dreamdrive.errors import InputError
from dreamdrive.prior.path_to_action import waypoints
from dreamdrive.prior.vista.path import asked_path, waypoints_by_round


def test_each_round_is_told_the_path_from_where_it_starts():
    """On a circle that looks the same from everywhere."""
    path = circle(8.0, 0.03, seconds=5.0, rate_hz=20)
    first, second = waypoints_by_round(path, np.array([0.0, 2.2]), 4.6)
    expected = waypoints(path)
    for made in (first, second):
        np.testing.assert_allclose(made.ahead_m, expected.ahead_m, atol=5e-3)
        np.testing.assert_allclose(made.right_m, expected.right_m, atol=5e-3)
    assert first == expected


def test_the_path_has_to_lead_to_the_last_frame():
    path = circle(8.0, seconds=2.2)
    assert len(waypoints_by_round(path, np.array([0.0]), 1.0)) == 1
    with pytest.raises(InputError, match=r"lasts 2.2 s; expected at least 2.4 s for these frames"):
        waypoints_by_round(path, np.array([0.0]), 2.4)
    with pytest.raises(InputError, match=r"expected at least 4.2 s"):
        waypoints_by_round(path, np.array([0.0, 2.2]), 2.9)


def test_the_path_of_the_frames_starts_at_the_first_of_them():
    asked = asked_path(circle(8.0, 0.03), np.array([0.5, 1.0]))
    np.testing.assert_allclose(
        asked.world_from_camera, circle(8.0, 0.03).world_from_camera[[0, 5]], atol=1e-9
    )
    np.testing.assert_allclose(asked.times_s, [0, 0.5])
