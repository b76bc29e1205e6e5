"""Hills: level at the start, followed by what stands on it and by what moves."""

import numpy as np
import pytest

from dreamdrive.scene.level import upright
from dreamdrive.scene.street.hills import STEEPEST, Hills
from dreamdrive.scene.street.layout import Relief

HILLS = Hills(Relief(4.0, 150.0), 5)
PLACES = np.random.default_rng(0).uniform(-150, 150, (500, 2))


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
    level, pose = Hills(Relief(), 0), upright((3, 4, 1))
    assert level.laid(pose) is pose
