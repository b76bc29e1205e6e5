"""Road users go on: which way, how fast, and what stays."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.prior.photo import PhotoStreet, layers_of
from dreamdrive.prior.photo.sight import sight_of
from dreamdrive.prior.photo.traffic import WALK_M_S, flowing, going_ahead, velocities_of
from dreamdrive.prior.photo.way import free_m
from dreamdrive.scene.street.street_class import StreetClass
from tests.prior.photo.streets import CAR, CAR_M, GROUND, street


def with_user(columns: slice, kind: StreetClass, lamps: bool = False) -> PhotoStreet:
    """The street without its car, and a user of the same size and distance elsewhere."""
    made = street()
    classes, road_users, depth, rgb = (
        x.copy() for x in (made.classes, made.road_users, made.depth_m, made.rgb)
    )
    plane = GROUND.depth_m(made.camera)
    classes[CAR] = np.where(plane[CAR] < 30, StreetClass.ROAD, StreetClass.STRUCTURE)
    road_users[CAR], depth[CAR] = 0, np.minimum(plane[CAR], 30)
    at = (CAR[0], columns)
    road_users[at], classes[at], depth[at], rgb[at] = 1, kind, CAR_M, (20, 20, 120)
    if lamps:
        rgb[30:33, columns.start + 1 : columns.start + 4] = (200, 30, 30)
    return replace(made, classes=classes, road_users=road_users, depth_m=depth, rgb=rgb)


@pytest.mark.parametrize(
    ("columns", "kind", "lamps", "ahead_m_s"),
    [
        (slice(42, 54), StreetClass.VEHICLE, False, 8.0),
        (slice(10, 22), StreetClass.VEHICLE, False, -8.0),
        (slice(10, 22), StreetClass.VEHICLE, True, 8.0),
        (slice(60, 72), StreetClass.VEHICLE, False, 8.0),
        (slice(10, 22), StreetClass.TWO_WHEELER, False, 0.0),
        (slice(10, 16), StreetClass.PERSON, False, WALK_M_S),
        (slice(0, 12), StreetClass.VEHICLE, False, 0.0),
    ],
)
def test_the_side_and_the_lamps_tell_the_way(
    columns: slice, kind: StreetClass, lamps: bool, ahead_m_s: float
) -> None:
    velocity = flowing(with_user(columns, kind, lamps), 8.0)
    np.testing.assert_allclose(velocity, [[0, 0, ahead_m_s]], atol=1e-9)


def test_who_stands_at_the_kerb_is_parked_unless_traffic_is_fast() -> None:
    made = with_user(slice(60, 72), StreetClass.VEHICLE)
    classes = made.classes.copy()
    classes[:, 74:][classes[:, 74:] == StreetClass.ROAD] = StreetClass.GROUND
    assert not flowing(replace(made, classes=classes), 8.0).any()
    np.testing.assert_allclose(flowing(replace(made, classes=classes), 20.0), [[0, 0, 20.0]], atol=1e-9)


def test_still_traffic_stands() -> None:
    assert not velocities_of(street(), "still", None).any()
    np.testing.assert_allclose(velocities_of(street(), "flow", 11.0)[0, 2], 11.0)


def test_who_drives_ahead_leaves_the_way_free() -> None:
    made = street()
    assert free_m(made) == pytest.approx(CAR_M)
    gone = going_ahead(made, flowing(made, 8.0))
    assert gone == [1]
    assert free_m(made, gone) > 2 * CAR_M
    assert going_ahead(made, flowing(made, 2.0)) == []


def test_a_user_is_seen_where_it_has_driven_and_the_road_where_it_was() -> None:
    made = street()
    layers = layers_of(made, leaving=[1])
    later = layers.at(1.0, np.array([[0.0, 0.0, 10.0]]))
    sight = sight_of(later, made.camera, GROUND)
    # At 20 m the car is half as large: its foot is 6 px below the horizon of row 27.
    car = sight.moving
    assert 0.2 < car.sum() / (made.road_users > 0).sum() < 0.4
    assert np.median(sight.depth_m[car & (sight.depth_m > 0)]) == pytest.approx(2 * CAR_M, rel=0.05)
    foot = (CAR[0].stop - 2, 48)
    assert not car[foot]
    assert np.abs(sight.rgb[foot].astype(int) - 90).max() < 25


def test_nothing_moves_at_the_time_of_the_photo_but_is_known_to() -> None:
    made = street()
    layers = layers_of(made)
    sight = sight_of(layers.at(0.0, np.array([[0.0, 0.0, 10.0]])), made.camera, GROUND)
    assert (sight.moving == (made.road_users > 0)).mean() > 0.98
    np.testing.assert_array_equal(sight.rgb, sight_of(layers, made.camera, GROUND).rgb)
