"""A photo as layers: drawn where it was taken it is the photo, from aside it shows what was hidden."""

import numpy as np

from dreamdrive.prior.photo import layers_of
from dreamdrive.prior.photo.sight import sight_of
from tests.prior.photo.streets import CAR, CAR_M, GROUND, WALL_M, street


def moved(right_m: float = 0.0, ahead_m: float = 0.0) -> np.ndarray:
    pose = np.eye(4)
    pose[0, 3], pose[2, 3] = right_m, ahead_m
    return pose


def test_where_it_was_taken_the_photo_is_seen() -> None:
    photo = street()
    sight = sight_of(layers_of(photo), photo.camera, GROUND)
    assert np.abs(sight.rgb.astype(int) - photo.rgb).mean() < 4
    inside = photo.depth_m > 0
    assert (sight.alpha[inside] > 0.5).mean() > 0.99
    known = inside & (sight.depth_m > 0)
    assert known.sum() > 0.8 * inside.sum()
    assert np.median(np.abs(sight.depth_m[known] / photo.depth_m[known] - 1)) < 0.01
    assert sight.made_up[inside].mean() < 0.05


def test_what_the_car_hid_is_made_up_behind_it() -> None:
    photo = street()
    here = photo.camera.at(moved(right_m=1.5))
    sight = sight_of(layers_of(photo), here, GROUND)
    # The car goes 12 px to the left, the wall 4: of what it hid, the last 8 px are seen.
    row, column = 30, CAR[1].stop - 8
    assert sight.alpha[row, column] > 0.5
    assert sight.made_up[row, column] > 0.5
    around = sight.depth_m[row - 2 : row + 2, column - 3 : column + 3]
    assert abs(np.median(around[around > 0]) / WALL_M - 1) < 0.1
    car = sight.depth_m[row, CAR[1].start - 12 + 8]
    assert abs(car / CAR_M - 1) < 0.05


def test_what_comes_nearer_is_told() -> None:
    photo = street()
    sight = sight_of(layers_of(photo), photo.camera.at(moved(ahead_m=5.0)), GROUND)
    row = 30
    assert abs(sight.nearer[row, 48] - np.log(CAR_M / (CAR_M - 5))) < 0.15
    assert sight.holes.mean() < 0.02


def test_the_street_goes_on_beyond_the_photo() -> None:
    photo = street()
    sight = sight_of(layers_of(photo), photo.camera.at(moved(right_m=1.0)), GROUND)
    assert (sight.alpha[30:, -10:] > 0.5).mean() > 0.95
