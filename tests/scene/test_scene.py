from dataclasses import replace

import numpy as np
import pytest
import torch
from tests.scene.scenes import make_scene

from dreamdrive.scene.actor import Actor
from dreamdrive.scene.scene import Scene


def test_the_scene_at_a_time_is_static_then_dynamic_without_gradients() -> None:
    scene = make_scene()
    now = scene.at(0.5)
    assert len(now) == len(scene.static) + len(scene.dynamic)
    assert torch.equal(now.means[:7], scene.static.means)
    assert torch.equal(now.means[7:], scene.dynamic_at(0.5).means)
    assert now.lifespan is None
    assert not any(t.requires_grad for t in now.tensors().values())
    assert not torch.equal(scene.at(0.1).means[7:], now.means[7:])


def test_asking_twice_gives_the_same_and_changes_nothing() -> None:
    scene = make_scene()
    before = {n: t.clone() for n, t in scene.dynamic.tensors().items()}
    assert torch.equal(scene.at(0.5).means, scene.at(0.5).means)
    assert all(torch.equal(before[n], t) for n, t in scene.dynamic.tensors().items())


def test_a_scene_without_dynamic_things_is_its_static_part() -> None:
    scene = make_scene(0, full=False)
    assert len(scene.at(0.3)) == 7


def test_the_recorded_drive() -> None:
    scene = make_scene()
    assert len(scene.trajectory) == 3
    assert (scene.trajectory.times_s == scene.times_s).all()


def test_counts_must_agree() -> None:
    with pytest.raises(ValueError, match=r"numbers of cameras, .* differ: \[0, 3, 3\]"):
        replace(make_scene(), cameras=())


def test_actor_tracks() -> None:
    actor = Actor(
        0, "a", "vehicle", 9, np.array([0.5, 1.0, 2.0]), np.array([[0, 0, 0], [3, 4, 0], [3, 4, 1.0]])
    )
    assert (actor.first_s, actor.last_s, actor.path_length_m) == (0.5, 2.0, 6.0)
    with pytest.raises(ValueError, match="increasing"):
        Actor(0, "a", "vehicle", 9, np.array([1.0, 1.0]), np.zeros((2, 3)))


def test_scenes_are_frozen() -> None:
    with pytest.raises(AttributeError):
        make_scene().static = None  # type: ignore[misc]
    assert isinstance(make_scene(), Scene)
