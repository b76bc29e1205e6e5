import numpy as np
import pytest
import torch

from dreamdrive.fit import SeedOptions, initialise
from tests.streets import small_street, street_clip, true_geometry


@pytest.fixture(scope="module")
def street():
    return small_street()


def test_seeds_lie_on_the_true_surface(street):
    geometry = true_geometry(street)
    seeds = initialise(street_clip(street), geometry, SeedOptions())
    for frame in np.unique(seeds.source_frame.numpy()):
        rows = (seeds.source_frame == int(frame)).numpy()
        camera = geometry.cameras[frame]
        local = (
            seeds.means.numpy()[rows] @ camera.camera_from_world[:3, :3].T + camera.camera_from_world[:3, 3]
        )
        column = (local[:, 0] / local[:, 2] * camera.fx_px + camera.cx_px).astype(int)
        row = (local[:, 1] / local[:, 2] * camera.fy_px + camera.cy_px).astype(int)
        np.testing.assert_allclose(local[:, 2], geometry.depth_m[frame][row, column], rtol=2e-3)


def test_static_surface_is_seeded_once_and_moving_things_once_a_frame(street):
    clip, geometry = street_clip(street), true_geometry(street)
    seeds = initialise(clip, geometry, SeedOptions())
    frames = len(clip)
    moving = seeds.features[:, 0] >= 0.5
    per_frame = torch.bincount(seeds.source_frame[moving], minlength=frames)
    assert (per_frame > 0).all()
    static = torch.bincount(seeds.source_frame[~moving], minlength=frames)
    assert static[-1] > 2 * static[:-1].max()


def test_features_are_those_of_the_source_pixel(street):
    clip, geometry = street_clip(street), true_geometry(street)
    seeds = initialise(clip, geometry, SeedOptions())
    assert seeds.features.shape[1] == 2 + 3
    colour = seeds.features[:, 2:] + 0.5
    base = seeds.sh[:, 0] * 0.28209479177387814 + 0.5
    torch.testing.assert_close(colour, base, atol=2e-3, rtol=0)


def test_held_out_frames_seed_nothing_and_are_not_read(street):
    clip = street_clip(street, hold_out=4)
    geometry = true_geometry(street)
    seeds = initialise(clip, geometry, SeedOptions())
    assert not np.isin(seeds.source_frame.numpy(), np.flatnonzero(clip.held_out)).any()
    clip.frames[clip.held_out] = 0
    again = initialise(clip, geometry, SeedOptions())
    torch.testing.assert_close(seeds.sh, again.sh, rtol=0, atol=0)


def test_sky_and_camera_fixed_pixels_seed_nothing(street):
    geometry = true_geometry(street)
    geometry.fixed_regions[:, -10:] = 1
    seeds = initialise(street_clip(street), geometry, SeedOptions())
    last = (seeds.source_frame == len(street.times_s) - 1).numpy()
    camera = geometry.cameras[-1]
    local = seeds.means.numpy()[last] @ camera.camera_from_world[:3, :3].T + camera.camera_from_world[:3, 3]
    row = local[:, 1] / local[:, 2] * camera.fy_px + camera.cy_px
    assert row.max() < camera.height_px - 10


def test_discs_on_the_road_lie_flat(street):
    geometry = true_geometry(street)
    seeds = initialise(street_clip(street), geometry, SeedOptions())
    height = geometry.ground.height_m(seeds.means.numpy())
    road = torch.from_numpy((np.abs(height) < 0.02) & (seeds.means.numpy()[:, 2] < 12))
    w, x, y, z = torch.nn.functional.normalize(seeds.quaternions[road]).unbind(1)
    normal = torch.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], dim=1)
    up = torch.tensor(geometry.ground.normal_world, dtype=torch.float32)
    assert (normal @ up).abs().median() > 0.99


def test_nothing_to_seed_is_said(street):
    geometry = true_geometry(street)
    geometry.depth_m[:] = 0
    with pytest.raises(ValueError, match="no frame shows anything solid"):
        initialise(street_clip(street), geometry, SeedOptions())
