"""Stereo is taken against what was fused where neighbours say so, and nowhere else."""

import numpy as np

from dreamdrive.geometry.depth import Fused, preferred, shifted_road_users
from tests.geometry.depth.test_in_time import Maps

FACTOR, FAR_OFF = np.float32(1.15), np.float32(1.3)


def sure(maps: Maps) -> np.ndarray:
    return np.where(maps.inverse > 0, 1, 0).astype(np.float32)


def test_right_stereo_takes_the_place_of_a_wrong_guess() -> None:
    maps = Maps()
    found = preferred(maps.view, maps.inverse * FAR_OFF, maps.inverse, sure(maps), maps.inverse > 0)
    assert (found == maps.inverse)[3][maps.near].mean() > 0.8


def test_wrong_stereo_does_not_take_the_place_of_a_right_guess() -> None:
    maps = Maps()
    found = preferred(maps.view, maps.inverse, maps.inverse * FAR_OFF, sure(maps), maps.inverse > 0)
    assert (found == maps.inverse)[3][maps.near].mean() > 0.98


def test_stereo_that_is_far_off_is_left_alone() -> None:
    maps = Maps()
    wrong = maps.inverse * np.float32(1.6)
    assert np.array_equal(preferred(maps.view, wrong, maps.inverse, sure(maps), maps.inverse > 0), wrong)


def test_stereo_without_support_and_what_moves_are_left_alone() -> None:
    maps = Maps()
    wrong, nothing = maps.inverse * FACTOR, np.zeros(maps.inverse.shape, bool)
    assert np.array_equal(preferred(maps.view, wrong, maps.inverse, 0 * sure(maps), ~nothing), wrong)
    assert np.array_equal(preferred(maps.view, wrong, maps.inverse, sure(maps), nothing), wrong)


def test_a_standing_road_user_moves_as_a_whole_to_where_neighbours_match_it() -> None:
    maps = Maps()
    columns = np.arange(maps.inverse.shape[2])
    user = maps.near[None] & (columns > 20) & (columns < 60) & np.ones(maps.inverse.shape, bool)
    user[[k for k in range(len(user)) if k != 3]] = False
    # A few of its pixels have stereo, and all go with them.
    some = np.where(user & (np.add.outer(np.arange(user.shape[1]), columns) % 5 == 0), sure(maps), 0)
    fused = Fused(np.where(user, maps.inverse * FACTOR, maps.inverse), sure(maps), maps.spread)
    instances = user.astype(np.uint16)
    found = shifted_road_users(maps.view, instances, fused, maps.inverse, some, user).inverse
    np.testing.assert_allclose(found, maps.inverse, rtol=1e-5)
    # Where neighbours match it better as it is, it stays.
    right = Fused(maps.inverse, sure(maps), maps.spread)
    stays = shifted_road_users(maps.view, instances, right, maps.inverse * FACTOR, some, user).inverse
    assert np.array_equal(stays, maps.inverse)
