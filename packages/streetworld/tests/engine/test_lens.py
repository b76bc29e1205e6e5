"""Lenses: fields of view, tilts and distortion."""

import numpy as np
import pytest

from dreamdrive.scene.street.layout import Lens
from streetworld.engine.lens import bent, level_from_camera, most_barrel, pinhole, unbent


def test_a_lens_is_as_wide_as_it_says() -> None:
    camera = pinhole(Lens(hfov_rad=1.2), (320, 192))
    left, right = camera.rays()[96, [0, -1]]
    across = np.arctan2(right[0], 1) - np.arctan2(left[0], 1)
    assert across == pytest.approx(1.2, abs=0.005)


def test_pitch_looks_down_and_roll_turns_clockwise() -> None:
    # In the frame of the mount: x ahead, y left, z up. The columns are right, down and ahead of the camera.
    down = level_from_camera(Lens(pitch_rad=0.2))
    assert down[2, 2] == pytest.approx(-np.sin(0.2))
    turned = level_from_camera(Lens(roll_rad=0.1))
    assert turned[2, 0] == pytest.approx(-np.sin(0.1))  # its right side hangs
    for axes in (down, turned, level_from_camera(Lens(pitch_rad=-0.1, roll_rad=0.3))):
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1)


@pytest.mark.parametrize("k1", [-0.12, -0.05, 0.0, 0.2])
def test_unbending_undoes_bending(k1: float) -> None:
    points = np.random.default_rng(1).uniform(-0.9, 0.9, (400, 2))
    np.testing.assert_allclose(unbent(bent(points, k1), k1), points, atol=1e-9)


def test_the_strongest_barrel_still_shows_the_corners() -> None:
    camera = pinhole(Lens(hfov_rad=1.5), (512, 288))
    k1 = 0.9 * most_barrel(camera)
    corner = np.array([[256 / camera.fx_px, 144 / camera.fx_px]])
    seen = unbent(corner, k1)
    np.testing.assert_allclose(bent(seen, k1), corner, atol=1e-4)
    assert np.linalg.norm(seen) > np.linalg.norm(corner)
