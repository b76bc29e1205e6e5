"""Plans, and points and poses between the planning frame and that of the car."""

import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from dreamdrive.tasks.plan import (
    AHEAD_RAD,
    LIDAR_AHEAD_M,
    Plan,
    constant_turn_and_acceleration,
    constant_velocity,
    ego_from_planning,
    planning_from_ego,
    planning_poses,
    stand_still,
)

points = arrays(np.float64, (5, 2), elements=st.floats(-200, 200))


@given(points, st.floats(-3, 3))
def test_points_come_back(points_m: np.ndarray, ahead_m: float) -> None:
    there = ego_from_planning(points_m, ahead_m)
    np.testing.assert_allclose(planning_from_ego(there, ahead_m), points_m, atol=1e-12)
    np.testing.assert_allclose(
        ego_from_planning(planning_from_ego(points_m, ahead_m), ahead_m), points_m, atol=1e-12
    )


def test_right_is_right_and_ahead_is_ahead() -> None:
    right, ahead = ego_from_planning(np.array([[2.0, 0.0], [0.0, 10.0]]))
    assert right.tolist() == [LIDAR_AHEAD_M, -2.0]
    assert ahead.tolist() == [10.0 + LIDAR_AHEAD_M, 0.0]


@pytest.mark.parametrize("waypoints", [np.zeros((0, 2)), np.array([[0.0, np.nan]])])
def test_a_plan_without_numbers_is_refused(waypoints: np.ndarray) -> None:
    with pytest.raises(ValueError, match="a plan needs"):
        Plan(waypoints)


def test_times_of_a_plan() -> None:
    assert Plan(np.zeros((3, 2))).times_s.tolist() == [0.5, 1.0, 1.5]
    with pytest.raises(ValueError, match="steps of 0"):
        Plan(np.zeros((3, 2)), 0.0)


def pose(x: float, y: float, yaw: float) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3] = Rotation.from_euler("z", yaw).as_matrix()
    made[:2, 3] = x, y
    return made


def test_the_car_now_is_the_origin_and_points_ahead() -> None:
    here = pose(300.0, -20.0, 2.5)
    np.testing.assert_allclose(planning_poses(here, here[None]), [[0, 0, AHEAD_RAD]], atol=1e-9)


def test_poses_are_those_of_the_lidar() -> None:
    """A car that has turned left on the spot has moved its lidar ahead of the axle to the left."""
    found = planning_poses(pose(5.0, 5.0, 0.0), pose(5.0, 5.0, np.pi / 2)[None])[0]
    np.testing.assert_allclose(found, [-LIDAR_AHEAD_M, -LIDAR_AHEAD_M, -np.pi], atol=1e-9)


@given(
    st.tuples(*[st.floats(-50, 50)] * 2, st.floats(-3, 3)),
    st.tuples(*[st.floats(-50, 50)] * 2, st.floats(-3, 3)),
)
def test_poses_are_points_in_the_frame_of_the_car(
    now: tuple[float, float, float], later: tuple[float, float, float]
) -> None:
    x, y, yaw = planning_poses(pose(*now), pose(*later)[None])[0]
    lidar = pose(*later) @ [LIDAR_AHEAD_M, 0, 0, 1]
    in_ego = (np.linalg.inv(pose(*now)) @ lidar)[:2]
    np.testing.assert_allclose(ego_from_planning(np.array([x, y])), in_ego, atol=1e-9)
    turned = yaw - AHEAD_RAD - (later[2] - now[2])
    assert abs((turned + np.pi) % (2 * np.pi) - np.pi) < 1e-9


def recorded(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times and poses of a real drive at 2 Hz."""
    with (folder / "city_SE3_egovehicle.csv").open() as file:
        rows = np.array([[float(each) for each in row] for row in list(csv.reader(file))[1:]])
    times_s, first = np.unique((rows[:, 0] - rows[0, 0]) / 1e9, return_index=True)
    rows = rows[first]
    picked = np.searchsorted(times_s, np.arange(times_s[0], times_s[-1], 0.5))
    poses = np.tile(np.eye(4), (len(picked), 1, 1))
    poses[:, :3, :3] = Rotation.from_quat(rows[picked][:, [2, 3, 4, 1]]).as_matrix()
    poses[:, :3, 3] = rows[picked][:, 5:8]
    return times_s[picked], poses


def test_a_real_drive_is_nearly_extrapolated(data_dir: Path) -> None:
    """Frames and times are right where going on is right: nothing else predicts a metre."""
    folder = data_dir / "planning" / "av2_adcf7d18"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there")
    times_s, poses = recorded(folder)
    errors = {"still": [], "velocity": [], "arc": []}
    for now in range(2, len(poses) - 6):
        past = planning_poses(poses[now], poses[now - 2 : now + 1])
        truth = planning_poses(poses[now], poses[now + 1 : now + 7])[:, :2]
        plans = {
            "still": stand_still(),
            "velocity": constant_velocity(past, times_s[now - 2 : now + 1]),
            "arc": constant_turn_and_acceleration(past, times_s[now - 2 : now + 1]),
        }
        for name, plan in plans.items():
            errors[name].append(np.linalg.norm(plan.waypoints_m - truth, axis=1)[1])
    mean = {name: np.mean(each) for name, each in errors.items()}
    assert mean["velocity"] < 0.3 * mean["still"]
    assert mean["arc"] < 0.3 * mean["still"]
