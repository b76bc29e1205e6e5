"""Drives on hills through lenses: the truth behind the pictures is exact."""

import numpy as np
import pytest
from msgspec.structs import replace

from dreamdrive.scene.street.layout import Lens, Light, Relief
from dreamdrive.scene.street.truth import DriveTruth, Semantic
from streetworld import StreetOptions, draw_street, drive, front_from_mount

SEED = 1_000_021


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    layout = draw_street(SEED, StreetOptions(2.4, edition=2, kind="town"))
    lens = Lens(hfov_rad=1.3, pitch_rad=0.05, roll_rad=-0.03)
    hilly = replace(layout, relief=Relief(5.0, 120.0), lens=lens, light=Light())
    return drive(hilly, 6, fps=5, size=(160, 96))


def lifted(street: DriveTruth, frame: int) -> np.ndarray:
    """What each pixel shows, in the world (H, W, 3)."""
    camera = street.cameras[frame]
    local = camera.rays() * street.depth_m[frame][..., None]
    return local @ camera.world_from_camera[:3, :3].T + camera.world_from_camera[:3, 3]


def on_the_map(street: DriveTruth, points: np.ndarray) -> np.ndarray:
    back = np.linalg.inv(street.world_from_map)
    return points @ back[:3, :3].T + back[:3, 3]


def test_depth_agrees_between_frames(street: DriveTruth) -> None:
    static = ~street.sky[1] & ~street.moving[1] & (street.depth_m[1] > 0)
    seen_at = street.cameras[4].project(lifted(street, 1)[static])
    inside = street.cameras[4].shows(seen_at)
    column, row = np.floor(seen_at[inside, :2]).astype(int).T
    keep = (column > 0) & (row > 0) & (column < 159) & (row < 95)
    column, row, depth = column[keep], row[keep], seen_at[inside, 2][keep]
    around = np.stack([street.depth_m[4][row + dy, column + dx] for dy in (-1, 0, 1) for dx in (-1, 0, 1)])
    hidden = depth > around.max(0) + 0.02
    agrees = (depth > around.min(0) - 0.02) & ~hidden
    assert agrees.mean() > 0.8
    assert (agrees | hidden).mean() > 0.98


def test_roads_lie_on_the_hills(street: DriveTruth) -> None:
    assert not street.world.hills.level
    for frame in (0, 5):
        points = on_the_map(street, lifted(street, frame)[street.semantic[frame] == Semantic.ROAD])
        near = np.linalg.norm(points[:, :2], axis=1) < 50
        above = points[:, 2] - street.world.hills.height_m(points[:, :2])
        assert near.sum() > 200
        assert np.abs(above[near]).max() < 0.12


def test_the_ground_touches_the_hills_below_the_first_camera(street: DriveTruth) -> None:
    assert street.ground.offset_m == pytest.approx(1.5, abs=0.02)
    points = lifted(street, 0)[90:][street.semantic[0][90:] == Semantic.ROAD]
    assert np.quantile(np.abs(street.ground.height_m(points)), 0.98) < 0.06


def test_labelled_pixels_lie_in_their_boxes(street: DriveTruth) -> None:
    for frame in (0, 3):
        points = lifted(street, frame)
        for box in street.boxes:
            mine = street.instance[frame] == box.instance
            pose = box.world_from_box[frame]
            local = (points[mine] - pose[:3, 3]) @ pose[:3, :3]
            beyond = (np.abs(local) - box.size_m / 2).max(axis=1, initial=-1)
            assert np.quantile(beyond, 0.95) < 0.05 if mine.any() else True, box.id
            assert (beyond < 0.3).all(), box.id  # a mirror


def test_the_camera_looks_as_its_lens_says(street: DriveTruth) -> None:
    up = street.cameras[0].world_from_camera[:3, :3].T @ street.world_from_map[:3, 2]
    shake = street.layout.ego.shake_rad
    assert np.arctan2(-up[0], -up[1]) == pytest.approx(-0.03, abs=2 * shake)
    assert np.arcsin(-up[2]) == pytest.approx(0.05, abs=2 * shake)
    assert 2 * np.arctan(80 / street.cameras[0].fx_px) == pytest.approx(1.3)


def test_flow_leads_to_the_same_surface_through_a_bent_lens(street: DriveTruth) -> None:
    bent = replace(street.layout, lens=replace(street.layout.lens, distortion=-0.12))
    world = street.world.changed(bent.light, bent.lens, bent.ego)
    seen = drive(bent, 2, fps=5, size=(160, 96), world=world)
    rows, columns = np.mgrid[:96, :160]
    to = np.stack([columns, rows], axis=-1) + 0.5 + seen.flow_px[0]
    x, y = (np.floor(to[..., k]).astype(int) for k in (0, 1))
    inside = (seen.instance[0] > 0) & (x >= 0) & (y >= 0) & (x < 160) & (y < 96)
    same = seen.instance[1][y[inside], x[inside]] == seen.instance[0][inside]
    assert same.mean() > 0.85
    # A barrel shows more than the pinhole: the same pixel lies farther out.
    assert (seen.depth_m[0] != street.depth_m[0]).mean() > 0.5


def test_cameras_of_the_car_are_placed_to_one_another_as_its_rig_says(street: DriveTruth) -> None:
    layout = street.layout
    front, left = (
        drive(layout, 1, size=(32, 20), world=street.world, mount=mount) for mount in ("front", "front_left")
    )
    apart = np.linalg.inv(np.linalg.inv(front.world_from_map)) @ np.linalg.inv(left.world_from_map)
    np.testing.assert_allclose(apart, front_from_mount(layout, "front_left"), atol=1e-9)
