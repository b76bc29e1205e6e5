"""Manoeuvres: exact shifts, tangent headings, the ground kept, the recorded speed kept."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.drive import manoeuvres as m
from dreamdrive.errors import InputError
from dreamdrive.scene.trajectory import Trajectory

UP = np.array([0.0, -1.0, 0.0])


def recorded(length_m: float = 40.0, frames: int = 41, curve_rad: float = 0.0) -> Trajectory:
    """A drive with an even curve, level, the heading along the path."""
    yaw = np.linspace(0, curve_rad, frames)
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(-yaw[:, None] * UP).as_matrix()
    step = length_m / (frames - 1)
    middle = 0.5 * (yaw[1:] + yaw[:-1])
    steps = step * np.stack([np.sin(middle), 0 * middle, np.cos(middle)], -1)
    poses[1:, :3, 3] = np.cumsum(steps, axis=0)
    return Trajectory(poses, np.arange(frames) * 0.1)


def heading_error_rad(path: Trajectory) -> float:
    """Largest angle between the view at the middle of a step and the step itself."""
    steps = np.diff(path.positions_m, axis=0)
    views = path.world_from_camera[:, :3, 2]
    middle = views[1:] + views[:-1]
    cosine = (steps * middle).sum(-1) / np.linalg.norm(steps, axis=-1) / np.linalg.norm(middle, axis=-1)
    return float(np.arccos(np.clip(cosine, -1, 1)).max())


@given(st.floats(-3, 3), st.floats(-1, 1), st.integers(2, 30))
@settings(max_examples=30)
def test_shift_is_exact_rigid_and_level(right_m: float, curve_rad: float, frames: int) -> None:
    drive = recorded(frames=frames, curve_rad=curve_rad)
    shifted = m.shift(drive, UP, right_m)
    moved_camera = np.einsum(
        "tji,tj->ti", drive.world_from_camera[:, :3, :3], shifted.positions_m - drive.positions_m
    )
    np.testing.assert_allclose(moved_camera, np.tile([right_m, 0, 0], (frames, 1)), atol=1e-9)
    assert (shifted.world_from_camera[:, :3, :3] == drive.world_from_camera[:, :3, :3]).all()


def test_shift_keeps_the_height_when_the_camera_is_tilted() -> None:
    drive = recorded()
    tilt = Rotation.from_euler("xz", [10, 3], degrees=True).as_matrix()
    poses = drive.world_from_camera.copy()
    poses[:, :3, :3] = poses[:, :3, :3] @ tilt
    shifted = m.shift(Trajectory(poses, drive.times_s), UP, 2.0)
    np.testing.assert_allclose((shifted.positions_m - drive.positions_m) @ UP, 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(shifted.positions_m - drive.positions_m, axis=1), 2.0)


@pytest.mark.parametrize(("name", "sign"), [("left", -1), ("right", 1)])
def test_turns_end_thirty_degrees_off_at_the_recorded_speed(name: str, sign: int) -> None:
    drive = recorded()
    path = m.manoeuvre(name, drive, UP)
    ahead = path.world_from_camera[-1, :3, 2]
    assert np.arctan2(ahead[0], ahead[2]) == pytest.approx(sign * np.deg2rad(30))
    assert sign * path.positions_m[-1, 0] > 3
    np.testing.assert_allclose(path.positions_m[:, 1], 0, atol=1e-9)
    steps = [np.linalg.norm(np.diff(p.positions_m, axis=0), axis=1) for p in (drive, path)]
    np.testing.assert_allclose(steps[0], steps[1])
    assert heading_error_rad(path) < np.deg2rad(0.1)


@pytest.mark.parametrize(("name", "sign"), [("lane-left", -1), ("lane-right", 1)])
@pytest.mark.parametrize("curve_rad", [0.0, 0.4])
def test_lane_changes_reach_the_next_lane_with_the_heading_along_the_path(
    name: str, sign: int, curve_rad: float
) -> None:
    drive = recorded(60.0, 121, curve_rad)
    path = m.manoeuvre(name, drive, UP)
    offset = ((path.positions_m - drive.positions_m) * drive.world_from_camera[:, :3, 0]).sum(-1)
    assert offset[0] == 0
    assert offset[-1] == pytest.approx(sign * 3.5)
    assert (np.diff(sign * offset) >= -1e-12).all()
    assert heading_error_rad(path) < np.deg2rad(0.6)
    np.testing.assert_allclose(
        path.world_from_camera[-1, :3, :3], drive.world_from_camera[-1, :3, :3], atol=1e-9
    )


def test_short_drives_turn_and_change_lanes_only_as_far_as_a_car_can(
    caplog: pytest.LogCaptureFixture,
) -> None:
    drive = recorded(2.0)
    path = m.manoeuvre("lane-left", drive, UP)
    assert 0.1 < -path.positions_m[-1, 0] < 0.6
    assert heading_error_rad(path) < np.deg2rad(0.6)
    turned = m.turn_left(drive, UP).world_from_camera[-1, :3, 2]
    assert np.arctan2(-turned[0], turned[2]) == pytest.approx(2.0 / m.TIGHTEST_M)
    assert "wanted" in caplog.text


@pytest.mark.parametrize("name", sorted(m.MANOEUVRES))
@pytest.mark.parametrize("frames", [1, 12])
def test_every_manoeuvre_works_on_a_standing_car(name: str, frames: int) -> None:
    drive = Trajectory(np.tile(np.eye(4), (frames, 1, 1)), np.arange(frames) * 0.1)
    path = m.manoeuvre(name, drive, UP)
    assert (path.times_s == drive.times_s).all()
    assert path.length_m == pytest.approx(0)


def test_stop_follows_the_path_slows_down_and_stands() -> None:
    drive = recorded(curve_rad=0.5)
    path = m.stop(drive, UP)
    speed = np.linalg.norm(np.diff(path.positions_m, axis=0), axis=1) / 0.1
    assert speed[0] == pytest.approx(10, rel=0.01)
    assert (np.diff(speed) < 1e-3).all()
    assert speed[-8:].max() < 1e-9
    distance = np.linalg.norm(path.positions_m[:, None] - drive.positions_m[None], axis=-1).min(axis=1)
    assert distance.max() < 0.51  # half a step of the recording: it stays on its path


def test_forward_is_the_recording() -> None:
    assert m.manoeuvre("forward", drive := recorded(), UP) is drive


def test_unknown_names_are_told_the_known_ones() -> None:
    with pytest.raises(InputError, match="lane-left"):
        m.manoeuvre("fly", recorded(), UP)


def test_resampling_passes_through_the_recorded_poses() -> None:
    drive = recorded(curve_rad=0.3)
    fine = m.resampled(drive, 30.0)
    assert len(fine) == 121
    np.testing.assert_allclose(fine.world_from_camera[::3], drive.world_from_camera, atol=1e-9)
