"""Heads and plates are made coarse, and nothing else is changed."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.data.pictures.images import read_image
from dreamdrive.scene.street.layout import Area, Box, Ego, Layout, TrackPoint
from dreamdrive.scene.street.truth import DriveTruth, Semantic
from dreamdrive.street_network import SHIPPED, blur, load_knowledge
from streetworld import drive


@cache
def street() -> DriveTruth:
    """A car and a person ahead on a road, in two frames."""
    car = Box("car", "car", (4.4, 1.8, 1.5), [TrackPoint(0, 14, 2.0, 0)])
    person = Box("person", "pedestrian", (0.5, 0.6, 1.75), [TrackPoint(0, 8, -2.0, 3.1)])
    road = Area("road", [(-20.0, -6.0), (90.0, -6.0), (90.0, 6.0), (-20.0, 6.0)])
    layout = Layout(Ego([TrackPoint(0, 0, 0, 0), TrackPoint(1, 1, 0, 0)]), areas=[road], boxes=[car, person])
    return drive(layout, 2, size=(384, 224))


@pytest.fixture(scope="module")
def changed() -> np.ndarray:
    """By how much, of 255, each pixel of the first frame is changed."""
    frame = street().frames[0].copy()
    made = blur(frame, load_knowledge(SHIPPED))
    np.testing.assert_array_equal(frame, street().frames[0])
    return np.abs(made.astype(int) - frame).max(axis=-1)


def rows_of(kind: Semantic) -> tuple[np.ndarray, np.ndarray]:
    """Where a thing is, and how far down each row of it, from 0 to 1."""
    here = street().semantic[0] == kind
    rows = np.flatnonzero(here.any(axis=1))
    assert len(rows) > 20
    return here, (np.arange(len(here)) - rows[0]) / (rows[-1] - rows[0])


def test_the_head_of_a_person_is_coarse(changed: np.ndarray) -> None:
    here, down = rows_of(Semantic.PEDESTRIAN)
    head = here & (down < 0.2)[:, None]
    assert (changed[head] > 3).mean() > 0.7
    assert not changed[here & (down > 0.75)[:, None]].any()


def test_the_lower_half_of_a_car_is_coarse(changed: np.ndarray) -> None:
    here, down = rows_of(Semantic.CAR)
    assert (changed[here & (down > 0.55)[:, None]] > 0).mean() > 0.7
    assert not changed[here & (down < 0.2)[:, None]].any()


def test_all_else_is_left_as_it_is(changed: np.ndarray) -> None:
    """What lies apart from both is the same to the byte."""
    away = np.ones(changed.shape, bool)
    for kind in (Semantic.PEDESTRIAN, Semantic.CAR):
        rows, columns = np.nonzero(street().semantic[0] == kind)
        tall = rows.max() - rows.min()
        around = slice(max(0, rows.min() - tall // 2), rows.max() + tall // 2)
        away[around, max(0, columns.min() - tall // 2) : columns.max() + tall // 2] = False
    assert away.mean() > 0.5
    assert changed[away].max() <= 1


def test_a_car_that_the_border_cuts_off_is_coarser_still(data_dir: Path) -> None:
    frame = read_image(data_dir / "photos" / "mapillary_suburb.jpg").rgb[::3, ::3]
    made = blur(np.ascontiguousarray(frame), load_knowledge(SHIPPED))
    height, width = frame.shape[:2]
    door = np.s_[round(0.9 * height) :, round(0.8 * width) :]
    assert np.abs(np.diff(made[door].astype(int), axis=1)).max() < 12
    assert np.abs(np.diff(frame[door].astype(int), axis=1)).max() > 60
    np.testing.assert_array_equal(made[: height // 4], frame[: height // 4])
