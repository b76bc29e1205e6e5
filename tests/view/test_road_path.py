"""A path on the road and the drive along it."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.scene.scene import Provenance
from dreamdrive.view.road_path import APART_M, drive_along, height_m, picked, spline
from tests.cli.test_commands import driving
from tests.scene.scenes import make_scene
from tests.view.scenes import wall

PLACE = st.tuples(st.floats(-50, 50), st.floats(-2, 2), st.floats(-50, 50))


def level(height: float = 1.7):
    return replace(driving(make_scene()), provenance=Provenance(up=(0.0, -1.0, 0.0), camera_height_m=height))


def test_it_goes_through_its_points_ahead_and_looks_along() -> None:
    scene = level()
    drive = drive_along(scene, [np.array([0.0, 1.7, z]) for z in (0.0, 3.0, 10.0)], 5.0)
    assert drive.times_s[0] == pytest.approx(scene.times_s[0])
    assert drive.times_s[-1] - drive.times_s[0] == pytest.approx(5.0)
    assert len(drive) == 101  # at 20 Hz
    np.testing.assert_allclose(drive.positions_m[:, :2], 0, atol=1e-9)  # 1.7 m above the road is 0
    speeds = np.diff(drive.positions_m[:, 2]) * 20
    np.testing.assert_allclose(speeds, 2.0, atol=1e-6)
    np.testing.assert_allclose(drive.world_from_camera[:, :3, :3], np.tile(np.eye(3), (101, 1, 1)), atol=1e-6)


def test_to_the_right_it_looks_to_the_right() -> None:
    drive = drive_along(level(), [np.array([x, 1.7, 0.0]) for x in (0.0, 8.0)], 2.0)
    np.testing.assert_allclose(drive.world_from_camera[5, :3, 2], [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(drive.world_from_camera[5, :3, 1], [0, 1, 0], atol=1e-9)


def test_the_first_cameras_tilt_is_kept() -> None:
    scene = level()
    tilted = np.eye(4)
    tilted[1:3, 1:3] = [[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]]
    cameras = tuple(c.at(c.world_from_camera @ tilted) for c in scene.cameras)
    drive = drive_along(replace(scene, cameras=cameras), [np.array([x, 1.7, 0.0]) for x in (0.0, 8.0)], 2.0)
    ahead = drive.world_from_camera[5, :3, 2]
    np.testing.assert_allclose(ahead, [np.cos(0.1), tilted[1, 2], 0], atol=1e-9)


@given(st.lists(PLACE, min_size=2, max_size=8))
def test_any_points_make_a_drive_or_a_sentence(places: list[tuple[float, float, float]]) -> None:
    points = [np.array(place) for place in places]
    assume(any(np.linalg.norm(each - points[0]) > APART_M for each in points))
    road = spline(points)
    np.testing.assert_allclose(road[0], points[0], atol=1e-4)
    assert max(float(np.linalg.norm(b - a)) for a, b in pairwise(road)) < 1.5
    for point in points:
        assert np.linalg.norm(road - point, axis=1).min() < APART_M + 1.0
    assert len(drive_along(level(), points, 3.0)) > 60


@pytest.mark.parametrize("points", [[], [np.zeros(3)], [np.zeros(3), np.full(3, 0.05)]])
def test_fewer_are_refused(points: list[np.ndarray]) -> None:
    with pytest.raises(InputError, match="a path needs two points on the road"):
        spline(points)


def test_a_time_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="a drive of 0 s: expected"):
        drive_along(level(), [np.zeros(3), np.ones(3)], 0.0)


def test_a_height_that_is_not_known_is_that_of_a_car() -> None:
    assert height_m(level(1.2)) == 1.2
    assert height_m(driving(make_scene())) == 1.5


def test_a_click_finds_what_stands_there() -> None:
    scene = replace(level(), static=wall(5.0))
    place = picked(scene, np.zeros(3), np.array([0.3, 0.1, 1.0]), 0.0)
    assert place is not None
    np.testing.assert_allclose(place, [1.5, 0.5, 5.0], atol=0.05)
    assert picked(scene, scene.trajectory.positions_m[0], np.array([0.0, 0.0, -1.0]), 0.0) is None
    assert picked(scene, np.array([0.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]), 0.0) is None  # straight up


def test_a_click_into_a_gap_finds_the_plane_of_the_road() -> None:
    scene = replace(level(), static=wall(-50.0))
    first = scene.trajectory.positions_m[0]
    place = picked(scene, first, np.array([0.0, 0.17, 1.0]), 0.0)
    assert place is not None
    np.testing.assert_allclose(place - first, [0.0, 1.7, 10.0], atol=1e-6)
    assert picked(scene, first, np.array([0.0, 0.01, 1.0]), 0.0) is None  # 170 m away
