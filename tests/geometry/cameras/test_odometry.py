import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dreamdrive.geometry.cameras.odometry import DEFAULT_SPEED_M_S, Odometry, drive, levelled, steadied
from dreamdrive.geometry.evidence import observe
from dreamdrive.scene.geometry import Ground
from tests.geometry.toy_drive import HEIGHT_M, make_clip, path_error, straight, turning

LEVEL = Ground(np.array([0.0, -1.0, 0.0]), HEIGHT_M)


def run(path: np.ndarray, blank_road: bool = False, ground: Ground = LEVEL) -> Odometry:
    clip = make_clip(path)
    seen = observe(clip)
    grey = seen.grey.copy()
    if blank_road:
        grey[:, 92:] = 100
    return drive(grey, seen.street, seen.small, clip.times_s, ground)


def test_a_turn_is_followed() -> None:
    path = turning(8, 0.6, 4.0)
    found = run(path)
    assert found.measured
    assert path_error(found.world_from_camera, path) < 0.01


def test_a_fast_turn_counts_as_motion() -> None:
    assert observe(make_clip(turning(6))).motion.moving.all()


def test_a_stop_and_go_drive_stops_and_goes_again() -> None:
    steps = [0.5, 0.5, 0.5, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5]
    found = run(straight(steps))
    assert (found.step_m[3:6] == 0).all()
    np.testing.assert_allclose(found.step_m[[0, 1, 2, 6, 7, 8]], 0.5, rtol=0.15)


def test_a_road_without_texture_gives_a_constant_speed_and_says_so() -> None:
    found = run(straight([0.5] * 5), blank_road=True)
    assert not found.measured
    np.testing.assert_allclose(found.step_m, DEFAULT_SPEED_M_S * 0.1)


def test_a_standing_camera_stays_where_it_is() -> None:
    found = run(straight([0.0] * 4))
    np.testing.assert_array_equal(found.world_from_camera, np.tile(np.eye(4), (5, 1, 1)))
    assert found.step_m == pytest.approx(0.0)


def test_a_tilted_camera_measures_its_steps_on_the_road_below_its_horizon() -> None:
    tilt = np.eye(4)
    tilt[:3, :3] = Rotation.from_euler("x", 4, degrees=True).as_matrix()
    found = run(straight([0.5] * 6) @ tilt, ground=Ground(LEVEL.normal_world @ tilt[:3, :3], HEIGHT_M))
    assert found.measured
    np.testing.assert_allclose(found.step_m, 0.5, rtol=0.15)
    np.testing.assert_allclose(
        found.world_from_camera[:, :3, 3] @ tilt[:3, :3].T @ LEVEL.normal_world, 0, atol=0.05
    )


def test_a_levelled_path_keeps_its_height_and_tilt_and_turns_as_it_did() -> None:
    path = turning(8)
    up = np.array([0.05, -1.0, 0.1]) / np.linalg.norm([0.05, -1.0, 0.1])
    found = levelled(path, up)
    np.testing.assert_allclose(found[:, :3, 3] @ up, 0, atol=1e-9)
    np.testing.assert_allclose(found[:, :3, :3] @ up, np.tile(up, (8, 1)), atol=1e-9)
    np.testing.assert_allclose(found[0], path[0], atol=1e-9)
    np.testing.assert_allclose(found[-1, :3, 2], path[-1, :3, 2], atol=0.1)
    again = levelled(found, up)
    np.testing.assert_allclose(again, found, atol=1e-9)


def test_a_steady_path_keeps_its_course_and_loses_its_shivers() -> None:
    path, times_s = np.tile(np.eye(4), (24, 1, 1)), 0.1 * np.arange(24)
    path[:, 2, 3] = 5 * times_s
    path[:, :3, :3] = Rotation.from_rotvec(np.outer(0.1 * times_s, [0, 1, 0])).as_matrix()
    np.testing.assert_allclose(steadied(path, times_s), path, atol=1e-9)
    shaken, random = path.copy(), np.random.default_rng(0)
    shaken[:, :3, 3] += random.normal(0, 0.1, (24, 3))
    shaken[:, :3, :3] = shaken[:, :3, :3] @ Rotation.from_rotvec(random.normal(0, 0.01, (24, 3))).as_matrix()
    found = steadied(shaken, times_s)
    assert np.square(found - path).mean() < 0.5 * np.square(shaken - path).mean()
    assert steadied(path[:1], times_s[:1]) == pytest.approx(path[:1])
