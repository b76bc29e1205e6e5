"""Depth of a look becomes that of a level road with what stands on it."""

import numpy as np
from hypothesis import given, strategies as st

from dreamdrive.prior.photo.fill import continued, inpainted
from dreamdrive.prior.photo.street import street_of
from dreamdrive.prior.photo.upright import upright
from dreamdrive.scene.street.look import CameraEstimate, Look, RoadUser
from dreamdrive.scene.street.street_class import StreetClass
from tests.prior.photo.streets import CAR, CAR_M, FOCAL_PX, HEIGHT, HEIGHT_M, WIDTH, street


def look_of(factor: float) -> Look:
    """What the network would see of the street, with all depth off by a factor and the car by another."""
    photo = street()
    depth = photo.depth_m / np.float32(HEIGHT_M) * np.float32(factor)
    depth[CAR] *= 1.3
    camera = CameraEstimate(WIDTH, HEIGHT, FOCAL_PX, 0.1, 0.0, 1.0, 0.0, 0.01, 0.0)
    user = RoadUser(StreetClass.VEHICLE, 0.9, (40, 27, 56, 39), 12 * 16)
    ones = np.ones_like(depth, np.float16)
    return Look(
        depth[None],
        0.1 * ones[None],
        photo.classes[None],
        ones[None],
        photo.road_users[None],
        ((user,),),
        (camera,),
        camera,
    )


def test_all_depth_follows_the_road_and_a_car_its_foot() -> None:
    photo = street()
    found = street_of(photo.rgb, photo.camera, look_of(0.8), HEIGHT_M)
    road = photo.classes == StreetClass.ROAD
    np.testing.assert_allclose(found.depth_m[road], photo.depth_m[road], rtol=0.05)
    wall = photo.classes == StreetClass.STRUCTURE
    assert np.median(np.abs(found.depth_m[wall] / photo.depth_m[wall] - 1)) < 0.03
    # Its bumper is nearer than its lowest pixels on the road.
    foot_m = 0.93 * HEIGHT_M * FOCAL_PX / (CAR[0].stop - 0.5 - HEIGHT / 2)
    assert np.abs(found.depth_m[CAR] / foot_m - 1).max() < 0.05
    assert abs(foot_m / CAR_M - 1) < 0.12
    assert (found.depth_m[photo.sky] == 0).all()


def test_a_wave_on_a_wall_is_smoothed_and_an_edge_is_not() -> None:
    generator = np.random.default_rng(0)
    depth = np.where(np.arange(80)[None] < 40, 10.0, 25.0) * np.exp(generator.normal(0, 0.03, (60, 80)))
    stands, regions = np.ones(depth.shape, bool), np.zeros(depth.shape, np.int64)
    smooth = upright(depth, regions, stands)
    assert np.abs(smooth[:, :38] / 10 - 1).max() < 0.04
    assert np.abs(smooth[:, 42:] / 25 - 1).max() < 0.04
    other = upright(depth, regions, ~stands)
    np.testing.assert_array_equal(other, depth)


@given(st.integers(8, 40), st.integers(8, 40), st.integers(0, 2**32 - 1))
def test_what_is_continued_stays_within_what_was_there(height: int, width: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    values = generator.uniform(2, 3, (height, width, 2)).astype(np.float32)
    weights = (generator.random((height, width)) < 0.2).astype(np.float32)
    weights[0, 0] = 1
    found = continued(values, weights)
    np.testing.assert_allclose(found[weights > 0], values[weights > 0], rtol=1e-5)
    assert found.min() > 1.99
    assert found.max() < 3.01


def test_holes_are_filled_from_around_them() -> None:
    picture = np.full((20, 20, 3), 80, np.uint8)
    holes = np.zeros((20, 20), bool)
    holes[8:12, 8:12] = True
    picture[holes] = 255
    assert np.abs(inpainted(picture, holes).astype(int) - 80).max() <= 2
    assert inpainted(picture, np.zeros_like(holes)) is picture
