"""Behind what is taken away stands the street: nothing that no frame saw, and no hole."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from dreamdrive.edit import Recolour, Remove, edited
from dreamdrive.edit.behind import filled_behind
from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene
from dreamdrive.stored import load_scene, save_scene

CAMERA = Camera(40.0, 40.0, 24.0, 16.0, 48, 32)
GREEN, RED, WHITE = (0.2, 0.6, 0.2), (0.8, 0.1, 0.1), (1.0, 1.0, 1.0)


def board(z_m: float, half_m: tuple[float, float], colour: tuple[float, ...], step_m: float) -> Gaussians:
    """A board that faces the camera."""
    x, y = (np.arange(-half, half + 1e-6, step_m) for half in half_m)
    places = np.stack([*np.meshgrid(x, y)], axis=-1).reshape(-1, 2)
    count = len(places)
    return Gaussians(
        means=torch.from_numpy(np.column_stack([places, np.full(count, z_m)])).float(),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(count, 1),
        log_scales=torch.full((count, 3), float(np.log(0.6 * step_m))),
        logit_opacities=torch.full((count,), 5.0),
        sh=((torch.tensor(colour) - 0.5) / SH_C0).repeat(count, 1)[:, None],
        source_frame=torch.zeros(count, dtype=torch.int64),
        actor=None,
    )


def scene(static: Gaussians) -> Scene:
    """A red board stands before the street in both views."""
    car = board(5.0, (0.5, 0.5), RED, 0.1)
    car = replace(car, actor=torch.zeros(len(car), dtype=torch.int64))
    track = Track(np.array([0.0, 0.1]), np.array([[0.0, 0, 5.0]] * 2), np.zeros(2))
    return Scene(
        static=static,
        dynamic=car,
        deformation=None,
        actors=(Actor(0, "actor 0", "vehicle", len(car), track),),
        sky=None,
        exposure=None,
        cameras=(CAMERA, CAMERA),
        times_s=np.array([0.0, 0.1]),
        held_out=np.zeros(2, bool),
    )


@pytest.fixture(scope="module")
def wall() -> Gaussians:
    return board(10.0, (7.0, 5.0), GREEN, 0.2)


def middle(shown: Scene) -> np.ndarray:
    """The colour in the middle of the picture."""
    return render_scene(shown, CAMERA, 0.0).colour[12:20, 20:28].mean((0, 1)).numpy()


def test_what_no_frame_saw_goes_with_what_hid_it(wall: Gaussians) -> None:
    hidden = board(8.0, (0.2, 0.2), WHITE, 0.2)
    before = scene(Gaussians.concatenate(wall, hidden))
    assert middle(before)[0] > 0.7
    assert middle(before.without(0)).min() > 0.3  # white
    after = edited(before, [Remove(0)])
    np.testing.assert_allclose(middle(after), GREEN, atol=0.05)


def test_a_hole_is_filled_from_around_it_where_it_is(wall: Gaussians, tmp_path: Path) -> None:
    off = wall.means[:, :2].abs().amax(dim=1) > 0.9
    before = scene(wall.select(off))
    assert middle(before.without(0)).max() < 0.35
    after = edited(before, [Remove(0)])
    np.testing.assert_allclose(middle(after), GREEN, atol=0.1)
    added = after.static.means[after.static.means[:, :2].abs().amax(dim=1) < 0.8]
    assert len(added)
    assert (added[:, 2] - 10).abs().max() < 1
    assert after.static.filled is not None
    made_up = after.static.means[after.static.filled]
    assert len(made_up)
    assert made_up[:, :2].abs().max() < 1
    save_scene(after, tmp_path / "scene")
    read = load_scene(tmp_path / "scene").static.filled
    assert read is not None
    assert torch.equal(read, after.static.filled)
    edge = render_scene(after, CAMERA, 0.0).colour[:, :8] - render_scene(before, CAMERA, 0.0).colour[:, :8]
    assert edge.abs().max() < 1 / 255


def test_what_a_view_shows_beside_the_actor_stays(wall: Gaussians) -> None:
    """Both in the hole of the first view and beside it in the second, which is further to the right."""
    off = wall.means[:, :2].abs().amax(dim=1) > 0.9
    pose = np.eye(4)
    pose[0, 3] = 1.5
    aside = CAMERA.at(pose)
    before = replace(scene(wall.select(off)), cameras=(CAMERA, aside))
    after = edited(before, [Remove(0)])
    gone = render_scene(before, aside, 0.1).dynamic_share - render_scene(after, aside, 0.1).dynamic_share
    beyond = cv2.dilate((gone > 0.01).numpy().astype(np.uint8), np.ones((5, 5))) == 0
    change = render_scene(after, aside, 0.1).colour - render_scene(before, aside, 0.1).colour
    assert change.abs().amax(dim=-1).numpy()[beyond].max() < 1 / 255


def test_what_stood_inside_the_actor_goes_too(wall: Gaussians) -> None:
    """A view that saw half of it through the actor is not enough to keep it."""
    before = scene(Gaussians.concatenate(wall, board(5.2, (0.2, 0.2), WHITE, 0.2)))
    thin = replace(before.dynamic, logit_opacities=torch.full((len(before.dynamic),), -1.0))
    (actor,) = before.actors
    box = ActorBox(np.array([2.0, 1.0, 2.0]), np.array([0.0, 0.0, 1.0]))
    track = replace(actor.track, positions_m=np.array([[0.0, 1.0, 5.0]] * 2))
    with_box = replace(before, dynamic=thin, actors=(replace(actor, box=box, track=track),))
    after = edited(with_box, [Remove(0)])
    np.testing.assert_allclose(middle(after), GREEN, atol=0.05)


def test_where_nobody_leaves_a_place_nothing_is_filled(wall: Gaussians) -> None:
    before = scene(wall)
    assert edited(before, [Recolour(0, GREEN)]).static is before.static
    kept = filled_behind(before, before)
    assert torch.equal(kept.static.means, before.static.means)
