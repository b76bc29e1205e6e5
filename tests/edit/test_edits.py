"""Edits of actors: what they change, what they leave, and what cannot be done."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.edit import Copy, Delay, Edit, Move, Recolour, Remove, Speed, Turn, edited
from dreamdrive.errors import InputError
from dreamdrive.scene.gaussians import SH_C0
from dreamdrive.scene.scene import Scene
from tests.scene.scenes import make_baseline, make_scene

T_S = 0.05


@pytest.fixture
def scene() -> Scene:
    """One actor, whose Gaussians live at all times that are asked for."""
    made = make_scene(dynamic=9)
    living = torch.tensor([[0.0, 50.0]]).repeat(len(made.dynamic), 1)
    return replace(made, dynamic=replace(made.dynamic, lifespan=living))


def middle(scene: Scene, actor: int, t_s: float = T_S) -> np.ndarray:
    moved = scene.dynamic_at(t_s)
    assert moved.actor is not None
    return moved.means[moved.actor == actor].double().mean(0).numpy()


def others(scene: Scene, t_s: float = T_S) -> torch.Tensor:
    moved = scene.dynamic_at(t_s)
    assert moved.actor is not None
    return moved.means[moved.actor < 0]


def test_it_moves_as_it_points_and_nothing_else_does(scene: Scene) -> None:
    moved = edited(scene, [Move(0, 2.0, 1.0)])
    ahead = scene.actor(0).ahead(scene.up)
    assert ahead is not None
    left = np.cross(scene.up, ahead)
    shift = middle(moved, 0) - middle(scene, 0)
    np.testing.assert_allclose(
        shift - (2 * ahead + left), middle(scene.moved(0), 0) - middle(scene, 0), atol=1e-4
    )
    assert torch.equal(others(moved), others(scene))
    track = moved.actor(0).track
    np.testing.assert_allclose(track.positions_m - scene.actor(0).track.positions_m, [2 * ahead + left] * 2)
    assert moved.actor(0).spread_m is not None
    assert scene.moved(0, left_m=3.0).moved(0, left_m=-3.0).actor(0).track.positions_m == pytest.approx(
        scene.actor(0).track.positions_m
    )


@pytest.mark.parametrize("nothing", [Move(0, 0.0, 0.0), Turn(0, 0.0), Delay(0, 0.0), Speed(0, 1.0)])
def test_an_edit_by_nothing_is_nothing(scene: Scene, nothing: Edit) -> None:
    made = edited(scene, [nothing])
    for t_s in (0.0, T_S, 0.7):
        for name, values in scene.at(t_s).tensors().items():
            assert torch.equal(values, made.at(t_s).tensors()[name])
    np.testing.assert_array_equal(made.actor(0).track.positions_m, scene.actor(0).track.positions_m)


def test_between_key_frames_its_path_keeps_its_shape(scene: Scene) -> None:
    """The recorded track has two points; the motion bends between them."""
    moved = scene.moved(0, 3.0, -1.0)
    shifts = [middle(moved, 0, t_s) - middle(scene, 0, t_s) for t_s in (0.0, 0.2, 0.4, 0.9)]
    np.testing.assert_allclose(shifts, [shifts[0]] * 4, atol=1e-5)


def test_it_turns_about_its_own_place(scene: Scene) -> None:
    turned = edited(scene, [Turn(0, 90.0)])
    np.testing.assert_allclose(turned.actor(0).track.positions_m, scene.actor(0).track.positions_m)
    np.testing.assert_allclose(turned.actor(0).track.yaw_rad - scene.actor(0).track.yaw_rad, np.pi / 2)
    before, after = scene.actor(0).ahead(scene.up), turned.actor(0).ahead(turned.up)
    assert before is not None
    assert after is not None
    level = before - (before @ scene.up) * scene.up
    assert after @ level == pytest.approx(0, abs=1e-9)
    assert np.cross(level, after) @ scene.up > 0  # to the left


def test_it_comes_later_with_all_that_it_shows(scene: Scene) -> None:
    delayed = edited(scene, [Delay(0, 0.5)])
    assert delayed.actor(0).track.first_s == 0.5
    lives = [each.dynamic.lifespan for each in (scene, delayed)]
    members = scene.dynamic.actor == 0
    assert lives[0] is not None
    assert lives[1] is not None
    torch.testing.assert_close((lives[1] - lives[0])[members], torch.tensor([[0.5, 0.0]]).repeat(3, 1))
    assert torch.equal(lives[1][~members], lives[0][~members])


def test_it_is_faster_from_its_first_time_on(scene: Scene) -> None:
    fast = edited(scene, [Speed(0, 2.0)])
    np.testing.assert_allclose(fast.actor(0).track.times_s, [0.0, 0.05])
    lifespan = fast.dynamic.lifespan
    assert lifespan is not None
    torch.testing.assert_close(lifespan[scene.dynamic.actor == 0], torch.tensor([[0.0, 25.0]]).repeat(3, 1))
    with pytest.raises(ValueError, match="expected a factor above 0"):
        scene.with_speed(0, 0.0)


def test_a_second_one_is_beside_the_first_and_moves_by_itself(scene: Scene) -> None:
    both = edited(scene, [Copy(0, 0.0, 3.0)])
    new = both.actors[-1].id
    assert new == 2  # the first index that no track has
    assert len(both.dynamic) == len(scene.dynamic) + 3
    assert scene.deformation is not None
    moved = edited(both, [Move(new, 1.0, 0.0)])
    np.testing.assert_allclose(middle(moved, 0), middle(scene, 0), atol=1e-5)
    left = both.actor(0).ahead(both.up)
    assert left is not None
    np.testing.assert_allclose(middle(moved, new) - middle(both, new), left, atol=1e-4)
    assert edited(both, [Remove(0)]).actors[0].id == new


def test_it_is_painted_and_its_shades_stay(scene: Scene) -> None:
    grey = scene.dynamic.sh.clone()
    grey[:] = 0
    grey[:, 0] = ((torch.arange(9.0) / 10 + 0.1) - 0.5)[:, None] / SH_C0
    scene = replace(scene, dynamic=replace(scene.dynamic, sh=grey))
    painted = edited(scene, [Recolour(0, (0.5, 0.25, 0.0))])
    members = scene.dynamic.actor == 0
    colour = painted.dynamic.sh[members][:, 0] * SH_C0 + 0.5
    torch.testing.assert_close(colour[1], torch.tensor([0.5, 0.25, 0.0]))  # the one of the middle
    torch.testing.assert_close(colour[:, 0], 2 * colour[:, 1])
    assert (colour[:, 0].diff() > 0).all()
    assert torch.equal(painted.dynamic.sh[~members], scene.dynamic.sh[~members])
    with pytest.raises(ValueError, match="three numbers from 0 to 1"):
        scene.recoloured(0, (2.0, 0.0, 0.0))


def test_what_cannot_be_done_is_a_sentence(scene: Scene) -> None:
    with pytest.raises(InputError, match=r"^turn 7: no actor 7; there are 0$"):
        edited(scene, [Move(0, 1.0, 0.0), Turn(7, 9.0)])
    with pytest.raises(InputError, match=r"^remove 0: no actor 0; there are none$"):
        edited(make_scene(dynamic=0, full=False), [Remove(0)])
    bare = replace(scene.actor(0), box=None)
    with pytest.raises(InputError, match=r"^move 0: nothing tells where actor 0 points"):
        edited(replace(scene, actors=(bare,)), [Move(0, 1.0, 0.0)])
    with pytest.raises(InputError, match=r"^copy 0: nothing moves actor 0: the scene has no motion"):
        edited(replace(scene, deformation=None), [Copy(0, 1.0, 0.0)])
    driven = replace(make_baseline("hexplane"), actors=scene.actors)
    with pytest.raises(InputError, match=r"^copy 0: motion: hexplane knows no tracks"):
        edited(driven, [Copy(0, 1.0, 0.0)])
    still = replace(scene.static, velocity=torch.zeros(len(scene.static), 3))
    with pytest.raises(InputError, match="moves as its pictures do"):
        edited(replace(scene, static=still), [Remove(0)])


def test_what_has_no_box_points_where_it_goes(scene: Scene) -> None:
    actor = scene.actor(0)
    way = np.array([[0.0, 0, 0], [0.0, 0.5, 4.0]])
    driving = replace(actor, box=None, track=replace(actor.track, positions_m=way))
    np.testing.assert_allclose(driving.ahead(scene.up), [0, 0, 1])
