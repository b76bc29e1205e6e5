from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.scene.actor import Actor, ActorBox, Track
from dreamdrive.scene.scene import Scene
from tests.scene.scenes import make_scene, per_frame_scene


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
    track = Track(np.array([0.5, 1.0, 2.0]), np.array([[0, 0, 0], [3, 4, 0], [3, 4, 1.0]]), np.zeros(3))
    assert (track.first_s, track.last_s, track.length_m) == (0.5, 2.0, 6.0)
    np.testing.assert_allclose(track.speed_m_s[[0, 2]], [10, 1])
    with pytest.raises(ValueError, match="increasing"):
        Track(np.array([1.0, 1.0]), np.zeros((2, 3)), np.zeros(2))
    with pytest.raises(ValueError, match="2 spreads for 3 points"):
        Actor(0, "a", "vehicle", 9, track, spread_m=np.zeros(2))


def test_a_track_goes_on_at_its_rate() -> None:
    track = Track(np.array([1.0, 2.0]), np.array([[0.0, 0, 0], [2.0, 0, 0]]), np.array([3.0, -3.0]))
    found = track.at(np.array([0.5, 1.5, 3.0]))
    np.testing.assert_allclose(found.positions_m[:, 0], [-1, 1, 4])
    # From 3 rad to -3 it is a short way over the half turn.
    np.testing.assert_allclose(found.yaw_rad, 3 + (2 * np.pi - 6) * np.array([-0.5, 0.5, 2]))


def test_noise_at_the_end_of_a_track_does_not_lead_it_astray() -> None:
    times_s = 0.1 * np.arange(10)
    positions = np.stack([8 * times_s, 0 * times_s, 0 * times_s], axis=1)
    positions[-2, 0] += 0.1
    found = Track(times_s, positions, np.zeros(10)).at(np.array([1.9]))
    assert found.positions_m[0, 0] == pytest.approx(8 * 1.9, abs=0.6)


def test_a_scene_without_an_actor_has_none_of_it() -> None:
    scene = make_scene()
    members = int((scene.dynamic.actor == 0).sum())
    assert members
    left = scene.without(0)
    assert not left.actors
    assert len(left.dynamic) == len(scene.dynamic) - members
    assert left.dynamic.actor is not None
    assert not (left.dynamic.actor == 0).any()
    assert torch.equal(left.static.means, scene.static.means)
    with pytest.raises(ValueError, match="no actor 7; there are 0"):
        scene.without(7)


def test_an_actor_follows_another_track_and_nothing_else_moves() -> None:
    scene = make_scene()
    members = scene.dynamic.actor == 0
    old = scene.actor(0).track
    moved = scene.with_track(0, replace(old, positions_m=old.positions_m + np.array([0, 0, 5.0])))
    before, after = scene.dynamic_at(0.05), moved.dynamic_at(0.05)
    change = (after.means - before.means)[members[scene.dynamic.alive_at(0.05)]]
    assert (change[:, 2] > 2).all()
    others = ~members[scene.dynamic.alive_at(0.05)]
    assert torch.equal(after.means[others], before.means[others])
    with pytest.raises(ValueError, match="no motion"):
        replace(scene, deformation=None).with_track(0, old)


def test_scenes_are_frozen() -> None:
    with pytest.raises(AttributeError):
        make_scene().static = None  # type: ignore[misc]
    assert isinstance(make_scene(), Scene)


def test_a_box_points_where_its_actor_turns() -> None:
    up = np.array([0.0, -1.0, 0.0])
    box = ActorBox(np.array([4.4, 1.8, 1.5]), np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(box.pointing(0.0, up), [0, 0, 1])
    np.testing.assert_allclose(box.pointing(np.pi / 2, up), [-1, 0, 0], atol=1e-12)


@pytest.mark.parametrize(("size_m", "ahead"), [([4.4, 0, 1.5], [0, 0, 1]), ([4.4, 1.8, 1.5], [0, 0, 2])])
def test_a_box_has_lengths(size_m: list[float], ahead: list[float]) -> None:
    with pytest.raises(ValueError, match="box: "):
        ActorBox(np.array(size_m), np.array(ahead, float))


def test_a_street_that_drifts_is_where_its_velocities_take_it() -> None:
    scene = per_frame_scene()
    assert scene.moves_per_frame
    assert not make_scene().moves_per_frame
    then = scene.static_at(0.3)
    number = torch.arange(len(then), dtype=torch.float32)
    assert torch.allclose(
        then.means[:, 2] - scene.static.means[:, 2], number * (0.3 - number / 10), atol=1e-6
    )
    faded = then.logit_opacities.sigmoid() / scene.static.logit_opacities.sigmoid()
    assert torch.allclose(faded, torch.exp(-0.5 * ((0.3 - number / 10) / 0.2) ** 2), atol=1e-5)
    assert then.velocity is None
    assert then.lifespan is None
    with pytest.raises(ValueError, match="need life spans"):
        replace(scene.static, lifespan=None).moved_to(0.0)


def test_more_that_stands_is_drawn_beside_what_was_fitted() -> None:
    scene = make_scene()
    more = replace(scene.static, sh=scene.static.sh[:, :1], features=None)
    both = scene.with_standing(more)
    assert len(both.static) == 2 * len(scene.static)
    assert both.static.sh.shape[1] == scene.static.sh.shape[1]
    torch.testing.assert_close(both.static.means[len(scene.static) :], scene.static.means)
    assert (both.static.sh[len(scene.static) :, 1:] == 0).all()
    assert both.dynamic is scene.dynamic
