import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.tasks.plan import CAMERA_AHEAD_M, Instant, Plan, instant_of, path_of_plan, plan_of_path
from tests.drive.test_occupancy import block, dots, scene_of

HALF_S = 0.5 * np.arange(1, 7)


def now() -> Instant:
    return instant_of(scene_of(dots(block((3, 4), (30, 31), (0.5, 1)))), 1.0, HALF_S)


def arc(radius_m: float, speed_m_s: float) -> Plan:
    """To the left; the origin drives on a circle."""
    turned = speed_m_s * HALF_S / radius_m
    return Plan(radius_m * np.column_stack([np.cos(turned) - 1, np.sin(turned)]))


@pytest.mark.parametrize(
    "plan", [arc(40, 10), arc(-60, 10), Plan(np.column_stack([0 * HALF_S, 10 * HALF_S]))]
)
def test_a_path_along_a_plan_is_planned_as_that_plan(plan: Plan) -> None:
    instant = now()
    path = path_of_plan(plan, instant, 1.0, 20.0)
    assert len(path) == 61
    found = plan_of_path(path, instant, 1.0)
    np.testing.assert_allclose(found.waypoints_m, plan.waypoints_m, atol=0.02)


def test_the_camera_turns_with_the_car_and_keeps_its_height() -> None:
    path = path_of_plan(arc(40, 10), now(), 1.0, 10.0)
    np.testing.assert_allclose(path.world_from_camera[0, :3, 3], [0, 0, 10], atol=1e-9)
    np.testing.assert_allclose(path.positions_m[:, 1], 0, atol=1e-9)
    ahead = path.world_from_camera[15, :3, 2]
    assert np.arctan2(-ahead[0], ahead[2]) == pytest.approx(15 / 40, abs=0.01)
    origin = path.positions_m[15] - CAMERA_AHEAD_M * ahead
    middle = np.array([-40.0, 0, 10 - CAMERA_AHEAD_M])
    assert np.linalg.norm(origin - middle) == pytest.approx(40, abs=0.02)


def test_a_car_that_stops_points_as_before() -> None:
    path = path_of_plan(Plan(np.column_stack([0 * HALF_S, np.full(6, 3.0)])), now(), 1.0, 10.0)
    np.testing.assert_allclose(path.world_from_camera[-1, :3, :3], np.eye(3), atol=1e-9)


def test_a_path_that_ends_too_soon_is_refused() -> None:
    instant = now()
    path = Trajectory(np.tile(np.eye(4), (2, 1, 1)), np.array([0.0, 1.4]))
    with pytest.raises(InputError, match=r"needs 0.5 s"):
        plan_of_path(path, instant, 1.0)


def test_what_no_car_drives_is_no_plan() -> None:
    instant = now()
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, 2, 3] = 1e6
    path = Trajectory(poses, np.array([0.0, 10.0]))
    with pytest.raises(InputError, match="leads 399990 m away in three seconds; expected metres"):
        plan_of_path(path, instant, 1.0)
    with pytest.raises(InputError, match="the car drives at 100000 m/s at 1 s; expected at most 100"):
        instant_of(scene_of(dots(block((3, 4), (30, 31), (0.5, 1)))), 1.0, HALF_S, path=path)
