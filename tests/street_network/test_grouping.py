"""Road users from peaks and offsets."""

import numpy as np
import torch

from dreamdrive.scene.street.street_class import ROAD_USERS, StreetClass
from dreamdrive.street_network.grouping import GroupingOptions, group, outlined

CAR, PERSON = (ROAD_USERS.index(kind) for kind in (StreetClass.VEHICLE, StreetClass.PERSON))


def empty(height: int = 40, width: int = 80) -> tuple[torch.Tensor, ...]:
    """Classes, confidence, peaks and offsets of a road without anybody."""
    classes = torch.full((height, width), int(StreetClass.ROAD))
    return (
        classes,
        torch.ones(height, width),
        torch.zeros(3, height // 4, width // 4),
        torch.zeros(2, height, width),
    )


def test_two_cars_that_touch_are_two() -> None:
    classes, sure, peaks, offset = empty()
    classes[10:30, 20:60] = StreetClass.VEHICLE
    peaks[CAR, 5, 7], peaks[CAR, 5, 12] = 0.9, 0.6
    columns = torch.arange(80.0)[None].expand(20, 80)
    offset[0, 10:30, 20:40] = 30 - columns[:, 20:40]
    offset[0, 10:30, 40:60] = 50 - columns[:, 40:60]
    offset[1] = 22 - torch.arange(40.0)[:, None]
    numbers, users = group(classes, sure, peaks, offset)
    assert [user.box_px for user in users] == [(20, 10, 40, 30), (40, 10, 60, 30)]
    assert [round(user.score, 3) for user in users] == [0.9, 0.6]
    assert (numbers[10:30, 20:40] == 1).all()
    assert (numbers[10:30, 40:60] == 2).all()
    assert (numbers > 0).sum() == 800


def test_the_halves_of_a_lorry_are_one_and_people_above_one_another_two() -> None:
    classes, sure, peaks, offset = empty()
    for kind, index in ((StreetClass.VEHICLE, CAR), (StreetClass.PERSON, PERSON)):
        classes[8:32, 20:40] = kind
        peaks.zero_()
        peaks[index, 3, 7], peaks[index, 6, 7] = 0.9, 0.7
        assert len(group(classes, sure, peaks, offset)[1]) == (1 if index == CAR else 2)


def test_classes_do_not_share_a_centre() -> None:
    classes, sure, peaks, offset = empty()
    classes[10:30, 20:40] = StreetClass.VEHICLE
    classes[10:30, 40:44] = StreetClass.PERSON
    peaks[CAR, 5, 7] = 0.9
    numbers, users = group(classes, sure, peaks, offset, GroupingOptions(reach=1))
    assert [user.kind for user in users] == [StreetClass.VEHICLE]
    assert (numbers[:, 40:] == 0).all()


def test_what_points_nowhere_near_a_centre_is_nobody() -> None:
    classes, sure, peaks, offset = empty()
    classes[10:30, 4:12] = StreetClass.VEHICLE
    classes[10:30, 60:70] = StreetClass.VEHICLE
    peaks[CAR, 5, 2] = 0.9
    numbers, users = group(classes, sure, peaks, offset, GroupingOptions(reach=0.2))
    assert len(users) == 1
    assert (numbers[:, 50:] == 0).all()


def test_low_and_second_peaks_and_small_things_do_not_count() -> None:
    classes, sure, peaks, offset = empty()
    classes[10:30, 20:40] = StreetClass.VEHICLE
    peaks[CAR, 5, 7], peaks[CAR, 5, 8] = 0.9, 0.8  # one hill
    peaks[CAR, 2, 6] = 0.1
    assert len(group(classes, sure, peaks, offset)[1]) == 1
    classes[10:30, 20:40] = StreetClass.ROAD
    classes[20, 28:30] = StreetClass.VEHICLE
    numbers, users = group(classes, sure, peaks, offset, GroupingOptions(least=1e-3))
    assert users == ()
    assert not numbers.any()


def test_without_road_users_there_are_none() -> None:
    numbers, users = group(*empty())
    assert users == ()
    assert not numbers.any()


def test_panes_and_letters_are_the_vehicle_and_another_road_user_is_not() -> None:
    classes, sure, peaks, offset = empty()
    classes[10:30, 20:60] = StreetClass.VEHICLE
    classes[14:18, 30:40] = StreetClass.STRUCTURE  # a pane
    classes[22:26, 44:48] = StreetClass.PERSON
    peaks[CAR, 5, 10] = 0.9
    numbers, users = group(classes, sure, peaks, offset, GroupingOptions(reach=1))
    assert (numbers[14:18, 30:40] == 1).all()
    assert (numbers[22:26, 44:48] == 0).all()
    assert users[0].pixels == 20 * 40 - 4 * 4
    assert (numbers > 0).sum() == users[0].pixels


def test_what_the_border_cuts_off_is_whole_up_to_it() -> None:
    mask = np.zeros((40, 60), bool)
    mask[5:35, :30] = True
    mask[15:25, :12] = False  # a pane that the border cuts
    found = outlined(mask, 0.02)
    assert found[5:35, :30].all()
    assert found.sum() == 30 * 30
