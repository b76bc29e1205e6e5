"""Hills: level at the start, followed by the ground, by what stands on it and by what moves."""

import numpy as np
import pytest

from dreamdrive.scene.layout import Relief
from dreamdrive.world.edition2.relief import STEEPEST, Hills
from dreamdrive.world.mesh import Mesh, quads, upright

HILLS = Hills(Relief(4.0, 150.0), 5)
PLACES = np.random.default_rng(0).uniform(-150, 150, (500, 2))


def ground(reach_m: float = 300.0) -> Mesh:
    corner = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * reach_m
    return quads(corner[None], 0)


def test_the_origin_is_level() -> None:
    assert HILLS.height_m(np.zeros((1, 2)))[0] == 0
    np.testing.assert_allclose(HILLS.slope(np.zeros((1, 2))), 0)
    assert np.ptp(HILLS.height_m(PLACES)) > 2


def test_slopes_are_those_of_the_heights() -> None:
    for axis, step in enumerate(np.eye(2) * 1e-4):
        rise = (HILLS.height_m(PLACES + step) - HILLS.height_m(PLACES - step)) / 2e-4
        np.testing.assert_allclose(HILLS.slope(PLACES)[:, axis], rise, atol=1e-7)


@pytest.mark.parametrize("seed", range(5))
def test_slopes_keep_within_what_the_waves_allow(seed: int) -> None:
    relief = Relief(0.08 * 200 / STEEPEST, 200.0)
    steep = np.linalg.norm(Hills(relief, seed).slope(PLACES[np.linalg.norm(PLACES, axis=1) > 60]), axis=1)
    assert 0.01 < steep.max() <= 0.0801


def test_a_mesh_follows_the_ground() -> None:
    lifted = HILLS.lifted(ground())
    flat = lifted.corners.reshape(-1, 3)
    np.testing.assert_allclose(flat[:, 2], HILLS.height_m(flat[:, :2]))
    middle = lifted.corners.mean(axis=1)
    near = np.linalg.norm(middle[:, :2], axis=1) < 60
    assert np.abs(middle[near, 2] - HILLS.height_m(middle[near, :2])).max() < 0.05
    # Textures stay where they were.
    np.testing.assert_allclose(lifted.uv.reshape(-1, 2), (flat[:, :2] * [1, -1] + 300) / 600, atol=1e-9)


def test_a_mesh_has_no_gaps_where_it_is_divided() -> None:
    lifted = HILLS.lifted(ground())
    corners = np.round(lifted.corners, 6)
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    ordered = np.array([sorted(map(tuple, edge)) for edge in edges]).reshape(-1, 6)
    _, count = np.unique(ordered, axis=0, return_counts=True)
    outer = (np.abs(edges[:, :, :2]) > 299.99).all(axis=1).any(axis=1)
    assert (count == 1).sum() == outer.sum()
    a, b = (lifted.corners[:, k, :2] - lifted.corners[:, 0, :2] for k in (1, 2))
    area = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    assert (area > 0).all()
    assert area.sum() == pytest.approx(600**2)


def test_cars_lie_on_the_slope_and_people_stand_plumb() -> None:
    place = np.array([40.0, -20.0, 0.7])
    car = HILLS.laid(upright(place))
    person = HILLS.laid(upright(place), plumb=True)
    (slope,) = HILLS.slope(place[None, :2])
    normal = np.array([*-slope, 1]) / np.linalg.norm([*slope, 1])
    np.testing.assert_allclose(car[:3, 2], normal, atol=1e-12)
    np.testing.assert_allclose(car[:3, :3] @ car[:3, :3].T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(person[:3, 2], [0, 0, 1])
    assert car[2, 3] == person[2, 3] == HILLS.height_m(place[None, :2])[0]
    heading = np.arctan2(car[1, 0], car[0, 0])
    assert heading == pytest.approx(0.7, abs=0.01)


def test_level_land_leaves_everything_as_it_is() -> None:
    level, mesh, pose = Hills(Relief(), 0), ground(), upright((3, 4, 1))
    assert level.lifted(mesh) is mesh
    assert level.laid(pose) is pose
