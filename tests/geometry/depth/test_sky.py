"""The sky mask on pictures whose sky is known."""

import numpy as np

from dreamdrive.geometry.depth.sky import above_horizon, sky_mask
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.geometry import Ground
from tests.geometry import toy

EVERYWHERE = np.ones((60, 80), bool)


def textured(height: int, width: int) -> np.ndarray:
    return np.random.default_rng(0).integers(40, 200, (height, width, 3)).astype(np.uint8)


def test_smooth_blue_above_texture_is_sky():
    frame = textured(60, 80)
    frame[:30] = (150, 180, 230)
    mask = sky_mask(frame, EVERYWHERE, EVERYWHERE)
    assert mask[:27].all()
    assert not mask[33:].any()


def test_dark_or_enclosed_or_low_regions_are_not_sky():
    frame = textured(60, 80)
    frame[:20] = (30, 30, 30)
    frame[25:35, 20:60] = (150, 180, 230)
    assert not sky_mask(frame, EVERYWHERE, EVERYWHERE).any()
    frame[:] = (200, 200, 200)
    above = np.zeros((60, 80), bool)
    above[:30] = True
    assert not sky_mask(frame, above, EVERYWHERE)[30:].any()


def test_unusable_pixels_are_no_sky_and_the_sky_may_start_below_them():
    frame = textured(60, 80)
    frame[:30] = (150, 180, 230)
    usable = EVERYWHERE.copy()
    usable[:8] = False
    mask = sky_mask(frame, EVERYWHERE, usable)
    assert not mask[:8].any()
    assert mask[10:27].all()


def test_horizon_follows_the_ground_normal():
    camera = Camera(50.0, 50.0, 40.0, 30.0, 80, 60)
    level = above_horizon(camera, None)
    assert level[:30].all()
    assert not level[30:].any()
    pitch = np.deg2rad(10)
    tilted = Ground(np.array([0.0, -np.cos(pitch), -np.sin(pitch)]), 1.5)
    rows = above_horizon(camera, tilted).all(axis=1).sum()
    assert abs(rows - (30 - 50 * np.tan(pitch))) <= 1


def test_the_toy_streets_sky_is_found():
    street = toy.drive([], count=1)
    above = above_horizon(street.posed.cameras[0], street.posed.ground)
    mask = sky_mask(street.clip.frames[0], above, np.ones(above.shape, bool))
    assert (mask != (street.depth_m[0] == 0)).mean() < 0.03
