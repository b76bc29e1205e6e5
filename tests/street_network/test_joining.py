"""Parts of one vehicle are made one."""

import numpy as np
import pytest

from dreamdrive.scene.street.look import RoadUser
from dreamdrive.scene.street.street_class import StreetClass
from dreamdrive.street_network.joining import JoiningOptions, joined

CLOSING = 0.2


class Picture:
    """A road with a lorry, whose box is number 2 and whose wheels are number 1."""

    def __init__(self) -> None:
        self.numbers = np.zeros((40, 60), np.uint16)
        self.numbers[5:25, 10:40] = 2
        self.numbers[25:35, 14:36] = 1
        self.depth = np.full((40, 60), 10.0, np.float32)
        self.kinds = [StreetClass.VEHICLE, StreetClass.VEHICLE]

    def found(self, **options: float) -> tuple[np.ndarray, tuple[RoadUser, ...]]:
        """Numbers and road users after joining."""
        users = tuple(
            RoadUser(kind, 0.9 - 0.1 * index, (0, 0, 1, 1), 1) for index, kind in enumerate(self.kinds)
        )
        classes = np.full(self.numbers.shape, int(StreetClass.ROAD))
        return joined(self.numbers, users, self.depth, classes, JoiningOptions(**options), CLOSING)


def test_parts_above_one_another_with_one_depth_are_one_vehicle() -> None:
    picture = Picture()
    numbers, users = picture.found()
    assert len(users) == 1
    assert users[0].score == 0.9
    assert users[0].box_px == (10, 5, 40, 35)
    assert users[0].pixels == (numbers == 1).sum() >= (picture.numbers > 0).sum()
    assert (numbers[picture.numbers > 0] == 1).all()


def test_a_lorry_behind_a_car_stays_another_one() -> None:
    picture = Picture()
    picture.depth[:25] = 12.0
    numbers, users = picture.found()
    assert len(users) == 2
    assert (numbers == picture.numbers).all()


def test_cars_beside_one_another_stay_two() -> None:
    picture = Picture()
    picture.numbers[:] = 0
    picture.numbers[10:30, 10:30], picture.numbers[10:30, 30:50] = 1, 2
    assert len(picture.found()[1]) == 2
    assert len(picture.found(beside=2.0)[1]) == 1


def test_a_rider_is_no_part_of_a_car() -> None:
    picture = Picture()
    picture.kinds[0] = StreetClass.PERSON
    assert len(picture.found()[1]) == 2


def test_those_that_touch_nothing_keep_their_order() -> None:
    picture = Picture()
    picture.numbers[:5, :8] = 3
    picture.kinds.append(StreetClass.PERSON)
    numbers, users = picture.found()
    assert [user.kind for user in users] == [StreetClass.VEHICLE, StreetClass.PERSON]
    assert (numbers[:5, :8] == 2).all()


@pytest.mark.parametrize("count", [0, 1])
def test_few_road_users_stay_as_they_are(count: int) -> None:
    picture = Picture()
    picture.numbers = (picture.numbers == 1).astype(np.uint16) * count
    picture.kinds = picture.kinds[:count]
    numbers, users = picture.found()
    assert len(users) == count
    assert (numbers == picture.numbers).all()
