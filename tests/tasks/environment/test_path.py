import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.scene.level import level_from_world
from dreamdrive.scene.scene import Scene
from dreamdrive.tasks.environment.path import RecordedPath, moved_pose, recorded_path
from tests.tasks.environment.scenes import HEIGHT_M, SPEED_M_S, scene, straight

CAMERA_M = 1.7


def circle(radius_m: float, seconds: float, behind_m: float) -> np.ndarray:
    """Poses of a camera ahead of an axle that drives a circle to the left, with a nod."""
    turned = SPEED_M_S * np.arange(round(10 * seconds) + 1) / 10 / radius_m
    poses = np.tile(np.eye(4), (len(turned), 1, 1))
    ahead = np.stack([-np.sin(turned), np.zeros(len(turned)), np.cos(turned)], axis=1)
    right = np.stack([np.cos(turned), np.zeros(len(turned)), np.sin(turned)], axis=1)
    poses[:, :3, 0], poses[:, :3, 2] = right, ahead
    middle = np.array([-radius_m, 0.0, -behind_m])
    poses[:, :3, 3] = middle + radius_m * right + behind_m * ahead
    poses[:, 1, 3] = 0.1 * np.sin(3 * turned)
    return poses


def path_of(made: Scene) -> RecordedPath:
    return recorded_path(made, level_from_world(made), CAMERA_M)


def test_a_straight_path_is_that_of_the_rear_axle() -> None:
    path = path_of(scene())
    assert path.length_m == pytest.approx(SPEED_M_S * 3.0, abs=0.01)
    np.testing.assert_allclose(
        path.at(np.array([0.0, 10.0])), [[-CAMERA_M, 0, 0], [10 - CAMERA_M, 0, 0]], atol=1e-9
    )
    assert path.speed_at(0.0) == pytest.approx(SPEED_M_S, rel=0.01)
    assert path.speed_at(1.5) == pytest.approx(SPEED_M_S, rel=0.01)
    assert path.time_at(path.along_at(1.23)) == pytest.approx(1.23, abs=1e-6)


def test_places_beside_it_have_a_side() -> None:
    path = path_of(scene())
    left = path.beside(5.0, 1.5, 6.0)
    assert (left.along_m, left.aside_m, left.yaw_rad) == pytest.approx((5.0 + CAMERA_M, 1.5, 0.0))
    assert path.beside(5.0, -1.5, 6.0).aside_m == pytest.approx(-1.5)


def test_it_goes_straight_on_at_both_ends() -> None:
    path = path_of(scene())
    after, before = path.beside(60.0, 2.0, path.length_m), path.beside(-9.0, -2.0, 0.0)
    assert (after.along_m, after.aside_m) == pytest.approx((60.0 + CAMERA_M, 2.0), abs=1e-6)
    assert (before.along_m, before.aside_m) == pytest.approx((-9.0 + CAMERA_M, -2.0), abs=1e-6)


def test_on_a_circle_the_way_and_the_heading_are_those_of_the_axle() -> None:
    made = scene(poses=circle(25.0, 3.0, CAMERA_M))
    path = path_of(made)
    assert path.length_m == pytest.approx(SPEED_M_S * 3.0, rel=0.01)
    middle = path.length_m / 2
    assert path.at(np.array(middle))[2] == pytest.approx(middle / 25.0, abs=0.01)
    inside = path.at(np.array(middle)) + np.array([-np.sin(middle / 25), np.cos(middle / 25), 0.0])
    assert path.beside(inside[0], inside[1], middle).aside_m == pytest.approx(1.0, abs=0.02)


def test_where_a_path_crosses_itself_the_near_part_counts() -> None:
    made = scene(poses=circle(8.0, 6.0, CAMERA_M), seconds=6.0)
    path = path_of(made)
    once = path.at(np.array(1.0))
    assert path.beside(once[0], once[1], 1.0).along_m == pytest.approx(1.0, abs=0.1)
    around = 2 * np.pi * 8.0
    assert path.length_m < around + 1.0 or path.beside(once[0], once[1], around).along_m > around / 2


def test_a_car_that_waits_has_a_path_straight_ahead() -> None:
    rng = np.random.default_rng(0)
    poses = straight(3.0)
    poses[:, :3, 3] = rng.normal(0, 0.01, (len(poses), 3))
    path = path_of(scene(poses=poses))
    assert path.length_m == pytest.approx(0.0, abs=0.1)
    assert abs(path.speed_at(1.0)) < 0.1
    on = path.beside(20.0, 1.0, 0.0)
    assert (on.along_m, on.aside_m) == pytest.approx((20.0 + CAMERA_M, 1.0), abs=0.1)


@pytest.mark.parametrize("poses", [straight(3.0), circle(25.0, 3.0, CAMERA_M)])
def test_on_the_path_the_camera_is_where_it_was(poses: np.ndarray) -> None:
    made = scene(poses=poses)
    level = level_from_world(made)
    path = path_of(made)
    for row in range(0, 29, 4):
        place = path.at(path.reached_m[row : row + 1])[0]
        found = moved_pose(made.trajectory, level, path, place, float(path.reached_m[row]))
        np.testing.assert_allclose(found, poses[row], atol=0.03)


def test_beside_the_path_it_is_moved_and_turned_and_as_high() -> None:
    poses = circle(25.0, 3.0, CAMERA_M)
    made = scene(poses=poses)
    level, path = level_from_world(made), path_of(made)
    place = path.at(path.reached_m[12:13])[0]
    aside = place + np.array([-1.5 * np.sin(place[2]), 1.5 * np.cos(place[2]), 0.2])
    there = moved_pose(made.trajectory, level, path, aside, float(path.reached_m[12]))
    was, now = (level @ pose for pose in (poses[12], there))
    assert now[2, 3] == pytest.approx(was[2, 3], abs=1e-6)
    assert HEIGHT_M - 0.11 < was[2, 3] < HEIGHT_M + 0.11
    turned = np.arctan2(now[1, 2], now[0, 2]) - np.arctan2(was[1, 2], was[0, 2])
    assert turned == pytest.approx(0.2, abs=0.01)
    axle = now[:2, 3] - CAMERA_M * now[:2, 2]
    np.testing.assert_allclose(axle, aside[:2], atol=0.03)


def test_a_path_as_long_as_none_is_driven_is_refused() -> None:
    poses = straight(3.0)
    poses[:, 2, 3] *= 1e4
    with pytest.raises(InputError, match="is 240 km long; expected a drive of up to 20 km"):
        path_of(scene(poses=poses))
