"""Which road users the published metrics draw."""

import numpy as np
import pytest

from dreamdrive.tasks.plan import INVALID, Agents, corners, stp3_rasters, uniad_rasters

KINDS = (
    "vehicle.car",
    "vehicle.bus.bendy",
    "vehicle.emergency.police",
    "human.pedestrian.adult",
    "movable_object.barrier",
)


def agents(seen: bool = True) -> Agents:
    """One of each kind, 5 m apart to the right, 20 m ahead, at two steps; at the second the car is gone."""
    boxes = np.zeros((2, len(KINDS), 5))
    boxes[..., 0] = 5.0 * np.arange(len(KINDS))
    boxes[..., 1:] = 20.0, 2.0, 2.0, 0.0
    there = np.ones((2, len(KINDS)), bool)
    there[1, 0] = False
    return Agents(boxes, there, KINDS, np.full(len(KINDS), seen))


def drawn(raster: np.ndarray, columns: list[int], row: int) -> list[bool]:
    return [bool(raster[row, column]) for column in columns]


def test_uniad_draws_vehicles_without_the_police() -> None:
    rasters = uniad_rasters(agents(), np.array([True, True]))
    columns = [100 + 10 * k for k in range(5)]
    assert drawn(rasters[0], columns, 140) == [True, True, False, False, False]
    assert drawn(rasters[1], columns, 140) == [False, True, False, False, False]
    assert rasters.max() == 1


def test_uniad_fills_steps_without_labels() -> None:
    rasters = uniad_rasters(agents(), np.array([True, False]))
    assert rasters[0].max() == 1
    assert (rasters[1] == INVALID).all()


def test_stp3_draws_vehicles_and_people_around_the_rear_axle_with_left_to_the_right() -> None:
    rasters = stp3_rasters(agents())
    columns = [100 - 10 * k for k in range(5)]
    assert drawn(rasters[0], columns, 142) == [True, True, True, True, False]
    assert drawn(rasters[1], columns, 142) == [False, True, True, True, False]
    rows = np.nonzero(rasters[0])[0]
    # 0.94 m further ahead than in the planning frame.
    assert (rows.min(), rows.max()) == (140, 144)


def test_stp3_leaves_out_what_was_never_seen() -> None:
    assert not stp3_rasters(agents(seen=False)).any()
    assert uniad_rasters(agents(seen=False), np.ones(2, bool)).any()


def test_road_users_must_be_boxes() -> None:
    good = agents()
    broken = good.boxes.copy()
    broken[1, 0] = np.nan  # gone, so that its numbers are nobody's
    Agents(broken, good.there, good.categories, good.seen)
    broken[0, 1, 2] = -1.0
    with pytest.raises(ValueError, match="no length or width below 0"):
        Agents(broken, good.there, good.categories, good.seen)
    with pytest.raises(ValueError, match="categories"):
        Agents(good.boxes, good.there, good.categories[:2], good.seen)
    assert corners(good.boxes[0]).shape == (5, 4, 2)
