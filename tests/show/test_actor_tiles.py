"""Tiles of actors show them where they are seen largest."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.show.actor_tiles import best_view, draw_actors
from tests.scene.scenes import make_scene

BOX = ActorBox(np.array([4.0, 1.8, 1.5]), np.array([0.0, 0.0, 1.0]))


def actor(*ahead_m: float) -> Actor:
    """A car before the camera, at so many metres in each of the frames."""
    places = np.array([[0.0, 1.0, z] for z in ahead_m])
    track = Track(1 / 3 + 0.1 * np.arange(len(places)), places, np.zeros(len(places)))
    return Actor(4, "actor 4", "vehicle", 0, track, BOX)


def test_the_view_is_that_in_which_it_is_near_and_whole() -> None:
    cameras = tuple(Camera(50.0, 50.0, 50.0, 30.0, 100, 60) for _ in range(3))
    scene = replace(make_scene(), cameras=cameras)
    view, box = best_view(scene, actor(30.0, 9.0, 40.0))
    assert view == 1
    assert 0 < box[0] <= box[2] < 100
    behind, whole = best_view(scene, actor(-5.0, -5.0, -5.0))
    assert behind == 1
    assert whole.tolist() == [0, 0, 100, 60]


def test_a_tile_for_each_and_a_sentence_for_none() -> None:
    scene = make_scene()
    several = replace(scene, actors=tuple(replace(actor(9.0, 9.0), id=k) for k in range(8)))
    assert draw_actors(several).shape == (2 * 160, 6 * 160, 3)
    with pytest.raises(InputError, match="no actor to draw"):
        draw_actors(replace(scene, actors=()))
