"""Ids are where the things are."""

from dataclasses import replace

import numpy as np

from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Provenance, Scene
from dreamdrive.show.ids import with_ids
from tests.scene.scenes import make_scene

CAMERA = Camera(100.0, 100.0, 100.0, 50.0, 200, 100)
BLACK = np.zeros((100, 200, 3), np.uint8)


def scene(right_m: float, ahead_m: float) -> Scene:
    """A car that stands there from 1 to 2 s, pointing ahead, and one place that has no box."""
    places = np.tile([[right_m, 1.5, ahead_m]], (2, 1))
    track = Track(np.array([1.0, 2.0]), places, np.zeros(2))
    car = Actor(7, "actor 7", "vehicle", 0, track, ActorBox(np.array([4.0, 1.8, 1.5]), np.array([0.0, 0, 1])))
    return replace(make_scene(), actors=(car,), provenance=Provenance(up=(0.0, -1.0, 0.0)))


def marked(right_m: float, ahead_m: float, t_s: float = 1.0) -> tuple[int, int] | None:
    """Column and row of the middle of the letters; None where there are none."""
    drawn = with_ids(BLACK, scene(right_m, ahead_m), CAMERA, t_s)
    rows, columns = np.nonzero(drawn.max(axis=2))
    return (round(float(columns.mean())), round(float(rows.mean()))) if len(rows) else None


def test_an_id_stands_above_what_is_seen_while_it_is_there() -> None:
    assert not BLACK.any()
    column, row = marked(0.0, 10.0) or (0, 0)
    assert abs(column - 100) <= 3
    assert 35 <= row <= 50  # the top is at the horizon
    left, _ = marked(-5.0, 10.0) or (0, 0)
    assert abs(left - 49) <= 4
    assert marked(0.0, 10.0, 0.5) is None
    assert marked(0.0, 10.0, 2.5) is None


def test_what_is_partly_outside_is_named_at_the_border_and_what_is_behind_is_not() -> None:
    column, _ = marked(9.0, 8.0) or (0, 0)  # its middle is beyond the right border, its front is not
    assert column > 180
    assert marked(30.0, 8.0) is None
    assert marked(0.0, -10.0) is None
