"""Second actors of one thing go with it."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.edit.doubles import without_doubles
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.scene import Scene
from tests.scene.scenes import make_scene

TIMES_S = np.array([0.0, 1.0])
WAY_M = np.array([[0.0, 1.5, 10.0], [0.0, 1.5, 20.0]])


def car(id: int, count: int, away_m: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Actor:
    box = ActorBox(np.array([4.0, 2.0, 1.5]), np.array([0.0, 0.0, 1.0]))
    return Actor(id, f"actor {id}", "vehicle", count, Track(TIMES_S, WAY_M + away_m, np.zeros(2)), box)


def street(*actors: Actor) -> Scene:
    made = make_scene(dynamic=9)
    of = torch.tensor([actors[k % len(actors)].id for k in range(9)])
    return replace(made, dynamic=replace(made.dynamic, actor=of), actors=actors)


def left(scene: Scene, actor: Actor) -> list[int]:
    gone = scene.without(actor.id)
    return [each.id for each in without_doubles(scene, gone, [actor]).actors]


def test_a_smaller_actor_inside_another_goes_with_it() -> None:
    whole, part = car(0, 6), car(1, 3, (0.4, 0.0, -1.0))
    made = street(whole, part)
    assert left(made, whole) == []
    after = without_doubles(made, made.without(0), [whole])
    assert not len(after.dynamic)


@pytest.mark.parametrize("away_m", [(3.0, 0.0, 0.0), (0.0, 0.0, 4.0)])
def test_who_is_beside_it_stays(away_m: tuple[float, float, float]) -> None:
    whole = car(0, 6)
    assert left(street(whole, car(1, 3, away_m)), whole) == [1]


def test_the_larger_one_stays() -> None:
    part = car(1, 3)
    assert left(street(car(0, 6), part), part) == [0]
