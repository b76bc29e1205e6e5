import numpy as np
import torch

from dreamdrive.fit.sky import estimate_sky
from tests.streets import small_street, street_clip, true_geometry


def test_sky_pixels_are_found_again():
    street = small_street()
    clip, geometry = street_clip(street), true_geometry(street)
    sky = estimate_sky(clip, geometry)
    seen = sky.colour(geometry.cameras[3]).numpy()[street.sky[3]]
    assert np.abs(seen - clip.frames[3][street.sky[3]] / 255.0).mean() < 0.03


def test_below_the_horizon_it_looks_like_the_street():
    street = small_street()
    clip, geometry = street_clip(street), true_geometry(street)
    shown = estimate_sky(clip, geometry).colour(geometry.cameras[0]).numpy()
    road = np.zeros_like(street.sky[0])
    road[-12:, 30:60] = True
    truth = clip.frames[:, road].mean(axis=(0, 1)) / 255.0
    sky = clip.frames[0][street.sky[0]].mean(axis=0) / 255.0
    assert np.abs(shown[road].mean(axis=0) - truth).max() < 0.3 * np.abs(sky - truth).max()


def test_held_out_frames_are_not_read():
    street = small_street()
    clip, geometry = street_clip(street, hold_out=4), true_geometry(street)
    sky = estimate_sky(clip, geometry)
    clip.frames[clip.held_out] = 0
    assert torch.equal(estimate_sky(clip, geometry).texture, sky.texture)
