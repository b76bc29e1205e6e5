"""Who rides a two-wheeler is one with it."""

from dataclasses import replace

import numpy as np

from dreamdrive.geometry.moving.riders import with_riders
from dreamdrive.scene.street.look import Look, RoadUser
from dreamdrive.scene.street.street_class import StreetClass
from tests.scene.street.test_look import small_look

SHAPE = (1, 40, 60)
WHEEL = (20, 20, 28, 32)
"""First column and row, last column and row + 1."""


def seen(*road_users: tuple[StreetClass, tuple[int, int, int, int]]) -> Look:
    """A frame with boxes as road users, numbered from 1 as they come; later ones lie on earlier ones."""
    instances = np.zeros(SHAPE, np.uint16)
    for number, (_, (left, top, right, bottom)) in enumerate(road_users, start=1):
        instances[0, top:bottom, left:right] = number
    found = tuple(
        RoadUser(kind, 0.8, box, int((instances == n).sum())) for n, (kind, box) in enumerate(road_users, 1)
    )
    zeros = np.zeros(SHAPE, np.float32)
    small = small_look(1)
    half = zeros.astype(np.float16)
    return replace(
        small,
        depth=zeros,
        spread=half,
        classes=zeros.astype(np.uint8),
        confidence=half,
        instances=instances,
        road_users=(found,),
    )


def rides(box: tuple[int, int, int, int], kind: StreetClass = StreetClass.PERSON) -> bool:
    """Whether that user is one with the two-wheeler afterwards."""
    look, ridden = with_riders(seen((StreetClass.TWO_WHEELER, WHEEL), (kind, box)), [0])
    one = look.instances[0, box[1], box[0]] == 1
    assert ridden.any() == one
    assert (ridden == ((look.instances == 1) & one)).all()
    return bool(one)


def test_a_person_on_a_two_wheeler_is_one_with_it() -> None:
    assert rides((20, 8, 28, 20))
    assert rides((22, 8, 26, 24))  # legs before it


def test_who_stands_beside_or_below_it_or_apart_does_not_ride() -> None:
    assert not rides((28, 8, 36, 32))  # beside
    assert not rides((20, 32, 28, 39))  # below
    assert not rides((20, 5, 28, 18))  # behind, and seen above it
    assert not rides((20, 8, 28, 20), StreetClass.VEHICLE)


def test_of_two_it_is_that_with_the_longer_border() -> None:
    look, _ = with_riders(
        seen(
            (StreetClass.TWO_WHEELER, (14, 20, 21, 32)),
            (StreetClass.TWO_WHEELER, (21, 20, 30, 32)),
            (StreetClass.PERSON, (19, 8, 28, 20)),
        ),
        [0],
    )
    assert look.instances[0, 10, 22] == 2


def test_frames_that_are_not_asked_for_stay() -> None:
    look = seen((StreetClass.TWO_WHEELER, WHEEL), (StreetClass.PERSON, (20, 8, 28, 20)))
    same, ridden = with_riders(look, [])
    assert (same.instances == look.instances).all()
    assert not ridden.any()
