"""Differences of two paths come out at their true size."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dreamdrive.metrics.paths import STRETCHES, compare_paths


def turned(degrees: float) -> np.ndarray:
    """A turn to the right, about the y axis that points down."""
    return Rotation.from_euler("y", degrees, degrees=True).as_matrix()


def straight(ahead_m: np.ndarray) -> np.ndarray:
    poses = np.tile(np.eye(4), (len(ahead_m), 1, 1))
    poses[:, 2, 3] = ahead_m
    return poses


def bend() -> np.ndarray:
    """16 m of a bend to the right that climbs."""
    angle = np.linspace(0, 0.4, 17)
    poses = np.tile(np.eye(4), (17, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("y", angle[:, None]).as_matrix()
    poses[:, :3, 3] = 40 * np.column_stack([1 - np.cos(angle), -0.05 * angle**2, np.sin(angle)])
    return poses


def test_a_similarity_is_no_error_and_its_scale_is_told() -> None:
    move = np.eye(4)
    move[:3, :3] = Rotation.from_rotvec([0.3, -1.0, 0.2]).as_matrix()
    move[:3, 3] = [5, -2, 7]
    found = bend()
    found[:, :3, 3] /= 1.1
    error = compare_paths(move @ found, bend())
    assert error is not None
    assert error.scale == pytest.approx(1.1)
    assert error.ate_m == pytest.approx(0, abs=1e-9)
    assert error.translation_percent == pytest.approx(0, abs=1e-8)
    assert error.rotation_deg_per_m == pytest.approx(0, abs=1e-5)


def test_a_reflection_is_not_taken_for_a_rotation() -> None:
    error = compare_paths(bend() * [[[-1], [1], [1], [1]]] * [[[-1, 1, 1, 1]]], bend())
    assert error is not None
    assert error.translation_percent > 10


def test_a_steady_extra_turn_is_measured_in_degrees_a_metre() -> None:
    asked, found = straight(np.arange(21.0)), straight(np.arange(21.0))
    found[:, :3, :3] = [turned(0.5 * metres) for metres in range(21)]
    error = compare_paths(found, asked)
    assert error is not None
    assert error.rotation_deg_per_m == pytest.approx(0.5)
    assert error.ate_m == pytest.approx(0, abs=1e-9)


def test_a_direction_that_is_off_is_measured_over_the_way() -> None:
    asked, found = straight(np.arange(21.0)), straight(np.arange(21.0))
    found[:, :3, :3] = turned(3)  # it looks 3 degrees off the way it drives
    error = compare_paths(found, asked)
    assert error is not None
    assert error.translation_percent == pytest.approx(200 * np.sin(np.radians(1.5)))
    assert error.rotation_deg_per_m == pytest.approx(0, abs=1e-6)


def test_a_change_of_speed_is_what_scale_leaves_over() -> None:
    asked = np.arange(17.0)
    found = np.concatenate([asked[:9], 8 + 1.25 * np.arange(1, 9)])
    error = compare_paths(straight(found), straight(asked))
    assert error is not None
    scale, shift = np.polyfit(found, asked, 1)
    assert error.scale == pytest.approx(scale)
    assert error.ate_m == pytest.approx(np.sqrt(np.mean((scale * found + shift - asked) ** 2)))
    assert error.ate_percent == pytest.approx(100 * error.ate_m / 16)
    shares = [
        abs(scale * (found[start + length] - found[start]) / length - 1)
        for length in range(2, 17, 16 // STRETCHES)
        for start in range(17 - length)
    ]
    assert error.translation_percent == pytest.approx(100 * np.mean(shares))


def test_a_path_that_never_leaves_misses_all_of_the_way() -> None:
    error = compare_paths(straight(np.zeros(9)), straight(np.arange(9.0)))
    assert error is not None
    assert error.translation_percent == pytest.approx(100)
    assert error.scale == 1


def test_nothing_is_measured_against_a_path_that_stands() -> None:
    assert compare_paths(straight(np.arange(9.0)), straight(np.zeros(9))) is None
