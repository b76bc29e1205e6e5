"""Depth of what stands on the road, from where it touches it."""

import numpy as np
from hypothesis import given, strategies as st

from dreamdrive.geometry.depth.contact import on_the_road
from dreamdrive.geometry.options import FusionOptions

HEIGHT, WIDTH, HORIZON = 60, 80, 20.0
NONE, VEHICLE = np.zeros(2, bool), np.array([False, True])


def plane() -> np.ndarray:
    """Inverse depth of a road 1.5 m below a camera of 100 px focal length, whose horizon is at a row."""
    rows = np.arange(HEIGHT) + 0.5 - HORIZON
    return np.repeat(np.maximum(rows, 0)[:, None] / 150, WIDTH, axis=1).astype(np.float32)


def standing(bottom: int, columns: slice = slice(20, 40)) -> tuple[np.ndarray, np.ndarray]:
    """A block that stands with its last row at ``bottom``, and the ground around it."""
    instances = np.zeros((HEIGHT, WIDTH), np.int32)
    instances[bottom - 12 : bottom + 1, columns] = 1
    return instances, (instances == 0) & (plane() > 0)


@given(bottom=st.integers(34, 55))
def test_a_block_has_the_depth_of_the_road_at_its_foot(bottom: int) -> None:
    instances, ground = standing(bottom)
    found = on_the_road(instances, ground, plane(), 1.5, NONE, FusionOptions())
    assert np.allclose(found.inverse[instances == 1], (bottom + 1 - HORIZON) / 150)
    assert (found.inverse[instances == 0] == 0).all()


def test_the_floor_between_wheels_is_not_taken_for_a_contact() -> None:
    instances, ground = standing(45)
    instances[42:46, 25:35] = 0  # wheels left and right of it
    ground = (instances == 0) & (plane() > 0)
    found = on_the_road(instances, ground, plane(), 1.5, NONE, FusionOptions())
    assert np.allclose(found.inverse[instances == 1], (46 - HORIZON) / 150)


def test_a_side_that_recedes_gets_farther() -> None:
    instances = np.zeros((HEIGHT, WIDTH), np.int32)
    for column in range(20, 60):
        instances[25 : 50 - (column - 20) // 4, column] = 1
    ground = (instances == 0) & (plane() > 0)
    found = on_the_road(instances, ground, plane(), 1.5, NONE, FusionOptions()).inverse
    assert found[30, 22] > 1.3 * found[30, 57] > 0


def test_corners_above_the_road_are_no_contact() -> None:
    """A truck from behind: beside its wheels the body ends half a metre above the road, seen below it."""
    instances, _ = standing(45, slice(28, 52))
    instances[40:46, 28:31] = instances[40:46, 49:52] = 0
    ground = (instances == 0) & (plane() > 0)
    found = on_the_road(instances, ground, plane(), 1.5, NONE, FusionOptions()).inverse
    foot = (46 - HORIZON) / 150
    assert np.allclose(found[36, 31:49], foot, rtol=1e-5)
    assert (found[36, [28, 51]] > 0.9 * foot).all()  # at the corners' own rows it were 0.77


def test_a_side_along_the_road_is_left_as_it_is() -> None:
    """Its line of contact leads to the middle of the horizon."""
    instances = np.zeros((HEIGHT, WIDTH), np.int32)
    for column in range(5, 30):
        instances[15 : round(HORIZON + 0.7 * (40 - column)), column] = 1
    ground = (instances == 0) & (plane() > 0)
    found = on_the_road(instances, ground, plane(), 1.5, NONE, FusionOptions()).inverse
    expected = 0.7 * (40 - np.arange(5, 30)) / 150
    assert np.allclose(found[17, 5:30], expected, rtol=0.12)


def test_nothing_is_said_where_the_foot_is_hidden() -> None:
    instances, _ = standing(45)
    nowhere = np.zeros((HEIGHT, WIDTH), bool)
    assert not on_the_road(instances, nowhere, plane(), 1.5, NONE, FusionOptions()).inverse.any()
    cut_off, ground = standing(HEIGHT - 1)
    assert not on_the_road(cut_off, ground, plane(), 1.5, NONE, FusionOptions()).inverse.any()


def test_far_contacts_are_less_sure() -> None:
    near, far = (on_the_road(*standing(bottom), plane(), 1.5, NONE, FusionOptions()) for bottom in (50, 34))
    assert 0.05 < near.spread.max() < far.spread.max()


def test_a_bumper_is_nearer_than_the_wheels() -> None:
    instances, ground = standing(45)
    found = on_the_road(instances, ground, plane(), 1.5, VEHICLE, FusionOptions())
    depth_m = 150 / (46 - HORIZON)
    tall_m = 13 * depth_m / 100
    assert np.allclose(1 / found.inverse[instances == 1], depth_m - FusionOptions().end_overhang * tall_m)


def test_sides_are_hardly_nearer_than_the_wheels() -> None:
    instances = np.zeros((HEIGHT, WIDTH), np.int32)
    for column in range(42, 60):
        instances[15 : 24 + (column - 40), column] = 1
    ground = (instances == 0) & (plane() > 0)
    wheels, surface = (
        1 / on_the_road(instances, ground, plane(), 1.5, kind, FusionOptions()).inverse[16, 44:58]
        for kind in (NONE, VEHICLE)
    )
    assert (surface < wheels).all()
    end_m = (
        wheels
        - 1
        / on_the_road(
            instances,
            ground,
            plane(),
            1.5,
            VEHICLE,
            FusionOptions(side_overhang=FusionOptions().end_overhang),
        ).inverse[16, 44:58]
    )
    assert (wheels - surface < 0.5 * end_m).all()


def rider() -> tuple[np.ndarray, np.ndarray]:
    """A two-wheeler (1) on the road and who sits on it (2), who meets no ground."""
    instances, ground = standing(45)
    instances[24:33, 24:36] = 2
    return instances, ground & (instances == 0)


def test_who_is_carried_is_where_the_carrier_is() -> None:
    found = on_the_road(*rider(), plane(), 1.5, np.zeros(3, bool), FusionOptions())
    assert np.allclose(found.inverse[rider()[0] == 2], (46 - HORIZON) / 150)
    assert (found.spread[rider()[0] == 2] > 0).all()


def test_nobody_stands_on_a_vehicle() -> None:
    found = on_the_road(*rider(), plane(), 1.5, np.array([False, True, False]), FusionOptions())
    assert not found.inverse[rider()[0] == 2].any()
