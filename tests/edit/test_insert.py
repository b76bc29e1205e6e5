"""Actors of other scenes: where they are set, how they look there, and what cannot be set in."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.edit import Insert, Remove, SetPlace, edited, inserted
from dreamdrive.errors import InputError
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.level import level_from_world
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import load_scene, save_scene
from tests.scene.scenes import make_baseline, make_scene


def on_a_road(made: Scene, height_m: float = 1.5) -> Scene:
    """The scene with a camera of a known height, and what moves alive at all times."""
    living = torch.tensor([[0.0, 50.0]]).repeat(len(made.dynamic), 1)
    return replace(
        made,
        dynamic=replace(made.dynamic, lifespan=living),
        provenance=replace(made.provenance, camera_height_m=height_m),
    )


@pytest.fixture
def scene() -> Scene:
    return on_a_road(make_scene(dynamic=9))


def own(scene: Scene, actor: int, t_s: float) -> Gaussians:
    moved = scene.dynamic_at(t_s)
    assert moved.actor is not None
    return moved.select(moved.actor == actor)


def test_its_first_place_is_the_one_given(scene: Scene) -> None:
    made = inserted(scene, scene, 0, SetPlace(12.0, 3.0, 5.0))
    new, level = made.actors[-1], level_from_world(scene)
    assert (new.id, new.kind, len(made.actors)) == (2, "vehicle", 2)
    first = level[:3, :3] @ new.track.positions_m[0] + level[:3, 3]
    was = level[:3, :3] @ scene.actor(0).track.positions_m[0] + level[:3, 3]
    np.testing.assert_allclose(first, [12.0, 3.0, was[2]], atol=1e-9)
    assert new.track.first_s == 5.0
    assert made.static is scene.static


def test_it_is_as_high_above_the_road_here_as_there(scene: Scene) -> None:
    made = inserted(on_a_road(scene, 2.5), scene, 0, SetPlace(12.0, 0.0))
    sunk = made.actors[-1].track.positions_m - scene.actor(0).track.positions_m
    np.testing.assert_allclose(sunk @ scene.up, -1.0)


def test_it_looks_as_it_did_there(scene: Scene) -> None:
    """At the time of its Gaussians, which is when its track begins, moved by as much as its track."""
    made = inserted(scene, scene, 0, SetPlace(12.0, 3.0, 0.0))
    then, now = own(scene, 0, 0.0), own(made, 2, 0.0)
    by_m = made.actors[-1].track.positions_m[0] - scene.actor(0).track.positions_m[0]
    np.testing.assert_allclose(now.means.numpy() - then.means.numpy(), np.tile(by_m, (3, 1)), atol=1e-5)
    torch.testing.assert_close(now.log_scales, then.log_scales)
    torch.testing.assert_close(now.sh, then.sh)
    turned = torch.nn.functional.normalize(now.quaternions) * torch.nn.functional.normalize(then.quaternions)
    torch.testing.assert_close(turned.sum(1).abs(), torch.ones(3))


def test_what_was_there_moves_as_before(scene: Scene) -> None:
    made = inserted(scene, scene, 0, SetPlace(12.0, 3.0))
    for actor in (-1, 0):
        torch.testing.assert_close(own(made, actor, 0.05).means, own(scene, actor, 0.05).means)
    assert torch.equal(edited(made, [Remove(2)]).dynamic.means, scene.dynamic.means)


def test_a_street_in_which_nothing_moves_takes_it(scene: Scene, tmp_path: Path) -> None:
    bare = on_a_road(make_scene(dynamic=0, full=False))
    made = inserted(bare, scene, 0, SetPlace(12.0, 3.0, 0.0))
    assert [actor.id for actor in made.actors] == [0]
    by_m = made.actors[0].track.positions_m[0] - scene.actor(0).track.positions_m[0]
    there = own(scene, 0, 0.0).means.numpy() + by_m
    np.testing.assert_allclose(own(made, 0, 0.0).means.numpy(), there, atol=1e-5)
    save_scene(made, tmp_path / "scene")
    read = load_scene(tmp_path / "scene")
    torch.testing.assert_close(own(read, 0, 0.05).means, own(made, 0, 0.05).means)


def test_it_is_as_bright_as_the_road_here(scene: Scene) -> None:
    def paved(shade: float) -> Scene:
        count = 60
        g = torch.Generator().manual_seed(0)
        flat = torch.rand(count, 3, generator=g) * 8 + torch.tensor([-4.0, 0.0, 1.0])
        flat[:, 1] = 1.5
        colour = torch.full((count, 1, 3), (shade - 0.5) / SH_C0)
        rows = torch.zeros(count, dtype=torch.int64)
        road = replace(scene.static.select(rows), means=flat, sh=colour, features=None)
        return replace(scene, static=road)

    made = inserted(paved(0.3), paved(0.2), 0, SetPlace(12.0, 3.0))
    assert scene.dynamic.actor is not None
    was = scene.dynamic.sh[scene.dynamic.actor == 0]
    now = made.dynamic.sh[made.dynamic.actor == 2]
    torch.testing.assert_close(now[:, 0] * SH_C0 + 0.5, 1.5 * (was[:, 0] * SH_C0 + 0.5))


def test_what_cannot_be_set_in_is_a_sentence(scene: Scene) -> None:
    place = SetPlace(10.0, 0.0)
    unknown = replace(scene, provenance=replace(scene.provenance, scale="none: nothing tells"))
    with pytest.raises(InputError, match="metres of the other scene are not known"):
        inserted(scene, unknown, 0, place)
    with pytest.raises(InputError, match="metres of this scene are not known"):
        inserted(unknown, scene, 0, place)
    with pytest.raises(InputError, match="does not know its road"):
        inserted(make_scene(), scene, 0, place)
    drifting = replace(scene.static, velocity=torch.zeros(len(scene.static), 3))
    with pytest.raises(InputError, match="the other scene moves as its pictures do"):
        inserted(scene, replace(scene, static=drifting), 0, place)
    with pytest.raises(ValueError, match="no actor 5; there are 0"):
        inserted(scene, scene, 5, place)
    with pytest.raises(ValueError, match="hexplane knows no tracks"):
        inserted(on_a_road_baseline(), scene, 0, place)


def on_a_road_baseline() -> Scene:
    made = make_baseline("hexplane")
    return replace(made, provenance=replace(made.provenance, camera_height_m=1.5))


def test_the_other_scene_may_be_gone_or_changed(scene: Scene, tmp_path: Path) -> None:
    save_scene(scene, tmp_path / "b" / "scene")
    edit = Insert.from_folder(tmp_path / "b", 0, 10.0, 0.0)
    assert len(edited(scene, [edit]).actors) == 2
    save_scene(replace(scene, held_out=~scene.held_out), tmp_path / "b" / "scene", replace=True)
    with pytest.raises(InputError, match="is another one than when this was said"):
        edited(scene, [edit])
    (tmp_path / "b" / "scene").rename(tmp_path / "c")
    with pytest.raises(InputError, match=r"there is no scene in .* any more"):
        edited(scene, [edit])


def test_no_gaussian_is_of_two_actors(scene: Scene) -> None:
    assert scene.deformation is not None
    with pytest.raises(ValueError, match="known already"):
        scene.inserted(scene.actor(0), scene.dynamic, scene.deformation)
