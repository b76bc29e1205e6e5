"""Paths as steps from pose to pose, and back."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.prior.cosmos import PER_METRE, relative_poses
from tests.prior.paths import circle


def accumulated(rows: np.ndarray) -> np.ndarray:
    """The poses (N + 1, 4, 4) that steps (N, 9) lead to, from the identity on."""
    poses = [np.eye(4)]
    for row in rows:
        step = np.eye(4)
        step[:3, 3] = row[:3] / PER_METRE
        step[:3, :3] = np.column_stack([row[3:6], row[6:9], np.cross(row[3:6], row[6:9])])
        poses.append(poses[-1] @ step)
    return np.stack(poses)


@settings(max_examples=20)
@given(st.floats(0, 30), st.floats(-0.1, 0.1), st.integers(1, 60))
def test_steps_lead_back_to_the_path(speed, left_per_m, steps):
    path = circle(speed, left_per_m, seconds=6.0)
    rows = relative_poses(path, steps, 10.0)
    assert rows.shape == (steps, 9)
    np.testing.assert_allclose(accumulated(rows), path.world_from_camera[: steps + 1], atol=1e-9)


def test_a_straight_drive_is_what_the_public_examples_show():
    """8.8 m/s at 10 Hz are about 1.2 units a step, along z."""
    rows = relative_poses(circle(8.8, seconds=6.0, rate_hz=2), 60, 10.0)
    np.testing.assert_allclose(rows[:, :3], np.tile([0, 0, 0.88 * PER_METRE], (60, 1)), atol=1e-12)
    assert rows[0, 2] == pytest.approx(1.2, abs=0.02)
    np.testing.assert_allclose(rows[:, 3:], np.tile([1, 0, 0, 0, 1, 0], (60, 1)), atol=1e-12)


def test_a_turn_to_the_left_has_negative_x_and_columns_of_the_rotation():
    path = circle(10.0, 0.1, seconds=1.0)
    row = relative_poses(path, 1, 10.0)[0]
    assert row[0] < 0
    np.testing.assert_allclose(row[3:6], path.world_from_camera[1, :3, 0], atol=1e-12)
    np.testing.assert_allclose(row[6:9], path.world_from_camera[1, :3, 1], atol=1e-12)


def test_a_path_that_ends_early_is_refused():
    with pytest.raises(InputError, match=r"lasts 5 s; expected at least 6 s \(61 frames at 10 Hz\)"):
        relative_poses(circle(8.0, seconds=5.0), 60, 10.0)
