"""Boxes of a log between their labels."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.scene.street.log import BoxTrack


def track(yaws_rad: list[float], places_m: list[tuple[float, float]]) -> BoxTrack:
    """Labels half a second apart."""
    count = len(yaws_rad)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("z", np.array(yaws_rad)[:, None]).as_matrix().reshape(-1, 3, 3)
    poses[:, :2, 3] = places_m
    unknown = np.full(count, -1)
    return BoxTrack(
        id="one",
        category="vehicle.car",
        times_s=0.5 * np.arange(count),
        world_from_box=poses,
        size_lwh_m=np.tile([4.0, 1.8, 1.5], (count, 1)),
        visibility=np.zeros(count, int),
        moves=unknown,
        lidar_points=unknown,
        attributes=((),) * count,
    )


@given(share=st.floats(0, 1), turn_rad=st.floats(-1.9, 1.9))
def test_a_box_goes_straight_and_turns_evenly(share: float, turn_rad: float) -> None:
    pose = track([0.3, 0.3 + turn_rad], [(0, 0), (2, 1)]).pose_at(0.5 * share)
    assert pose is not None
    np.testing.assert_allclose(pose[:2, 3], [2 * share, share], atol=1e-9)
    yaw = np.arctan2(pose[1, 0], pose[0, 0])
    assert np.remainder(yaw - 0.3 - share * turn_rad + np.pi, 2 * np.pi) - np.pi == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(("time_s", "ahead"), [(0.2, 1.0), (0.3, -1.0)])
def test_a_box_labelled_the_other_way_round_never_stands_across(time_s: float, ahead: float) -> None:
    pose = track([0.0, np.pi], [(0, 0), (2, 0)]).pose_at(time_s)
    assert pose is not None
    np.testing.assert_allclose(pose[:3, 0], [ahead, 0, 0], atol=1e-9)
    np.testing.assert_allclose(pose[:2, 3], [4 * time_s, 0], atol=1e-9)


def test_nothing_is_known_before_the_first_and_after_the_last_label() -> None:
    made = track([0.0, 0.0], [(0, 0), (2, 0)])
    assert made.pose_at(-0.1) is None
    assert made.pose_at(0.6) is None
    assert made.pose_at(0.54) is not None
