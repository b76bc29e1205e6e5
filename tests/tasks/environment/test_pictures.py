from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.scene.actor import Track
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene, set_threads, threads
from dreamdrive.tasks.environment import pictures as module
from dreamdrive.tasks.environment.pictures import PictureOptions, Pictures, Shifted
from dreamdrive.tasks.environment.rig import mount, scene_rig
from tests.fit.pretended import copies_to_the_cpu, pretending, splat_there
from tests.tasks.environment.scenes import AHEAD, ONCOMING, scene, splats, two_cameras
from tests.tasks.environment.test_rig import FRONT

ALL = PictureOptions(least_weight=0.0)
SIZE = (64, 40)


def pictures(made: Scene, options: PictureOptions = ALL, only_front: bool = True) -> Pictures:
    return Pictures(made, scene_rig(made, FRONT, SIZE, only_front), options)


def ego_at(x_m: float, y_m: float = 0.0) -> np.ndarray:
    """World from an ego whose front camera is at the world's origin for x = 0."""
    pose = np.eye(4)
    pose[:3, 3] = -y_m, 0.0, x_m
    return pose @ np.linalg.inv(FRONT)


def rendered(made: Scene, time_s: float, pose: np.ndarray, of_rig: int = 0) -> np.ndarray:
    rig = scene_rig(made, FRONT, SIZE, only_front=False)
    camera = rig[of_rig].pinhole.at(pose @ rig[of_rig].ego_from_camera)
    return np.rint(render_scene(made, camera, time_s, of_rig=of_rig).colour.numpy() * 255).astype(np.uint8)


def moving(made: Scene, time_s: float, pose: np.ndarray) -> np.ndarray:
    """Pixels that actors cover."""
    rig = scene_rig(made, FRONT, SIZE, only_front=True)
    return render_scene(made, rig[0].pinhole.at(pose @ rig[0].ego_from_camera), time_s).dynamic.numpy()


def test_with_all_gaussians_pictures_are_those_of_the_scene() -> None:
    made = scene(AHEAD, ONCOMING)
    drawn = pictures(made)
    for time_s, x_m, y_m in ((0.0, 0.0, 0.0), (1.05, 9.0, 1.0), (2.9, 20.0, -1.0), (0.0, 0.0, 0.0)):
        found = drawn.draw(time_s, ego_at(x_m, y_m))
        assert found.shape == (1, 40, 64, 3)
        np.testing.assert_array_equal(found[0], rendered(made, time_s, ego_at(x_m, y_m)))
        assert moving(made, time_s, ego_at(x_m, y_m)).any()


def test_each_camera_has_its_own_place_and_exposure() -> None:
    made = two_cameras(scene(AHEAD))
    found = pictures(made, only_front=False).draw(1.0, ego_at(8.0))
    assert len(found) == 2
    for of_rig in (0, 1):
        np.testing.assert_array_equal(found[of_rig], rendered(made, 1.0, ego_at(8.0), of_rig))


def test_scenes_without_sky_exposure_or_anything_that_moves_are_drawn() -> None:
    made = replace(scene(), sky=None, exposure=None)
    np.testing.assert_array_equal(pictures(made).draw(1.0, ego_at(8.0))[0], rendered(made, 1.0, ego_at(8.0)))


def test_with_a_least_weight_they_are_nearly_the_same() -> None:
    made = scene(AHEAD, ONCOMING)
    few = pictures(made, PictureOptions(least_weight=0.02))
    all_of_it = few._standing
    few.leave_out([ego_at(x) for x in (0.0, 4.0, 8.0)])
    assert few._standing < 0.9 * all_of_it
    difference = few.draw(1.0, ego_at(6.0))[0].astype(float) - rendered(made, 1.0, ego_at(6.0))
    assert np.sqrt(np.square(difference).mean()) < 2.0


def test_what_is_hidden_is_left_out_and_what_was_not_looked_at_stays() -> None:
    made = scene()
    across = np.stack(np.meshgrid(np.arange(-4, 4, 0.15), np.arange(-4, 2, 0.15)), axis=-1).reshape(-1, 2)
    board = np.column_stack([across, np.full(len(across), 10.0)])
    hidden, behind = board + np.array([0, 0, 1.0]), np.array([[0.0, 0.0, -20.0]])
    parts = [splats(places, 3, 0.15) for places in (board, hidden[::7], behind)]
    static = Gaussians.concatenate(*parts)
    made = replace(made, static=replace(static, logit_opacities=torch.full((len(static),), 8.0)))
    drawn = pictures(made, PictureOptions(least_weight=0.05))
    before = drawn.draw(0.0, ego_at(0.0))
    drawn.leave_out([ego_at(0.0)])
    kept = drawn._standing
    assert len(parts[0]) * 0.9 < kept <= len(parts[0]) + len(parts[2])
    assert np.abs(drawn.draw(0.0, ego_at(0.0)).astype(float) - before).mean() < 0.5
    assert float(drawn._buffer[0][:kept, 2].min()) == -20.0


def test_an_actor_that_is_late_looks_as_it_did_then() -> None:
    made = scene(AHEAD, ONCOMING)
    found = pictures(made).draw(2.0, ego_at(4.0), [Shifted(0, 0.8, True)])
    alone = [replace(made.without(other), sky=None) for other in (0, 1)]
    late = moving(alone[1], 0.8, ego_at(4.0))
    assert late.any()
    then = rendered(made, 0.8, ego_at(4.0))[late].astype(float)
    now = found[0][late].astype(float)
    assert np.abs(now - then).mean() < 2.0


def test_after_the_end_it_moves_on_as_a_track_says() -> None:
    made = scene(AHEAD, seconds=1.0)
    steered = made.with_track(0, Track(np.array([0.0]), np.array([[0.0, 1.5, 30.0]]), np.zeros(1)))
    found = pictures(made).draw(3.0, ego_at(12.0), [Shifted(0, 2.0, True)])
    np.testing.assert_allclose(
        made.actors[0].track.at(np.array([2.0])).positions_m, [[0, 1.5, 30]], atol=1e-9
    )
    np.testing.assert_array_equal(found[0], rendered(steered, 1.0, ego_at(12.0)))


def test_what_is_not_there_is_not_drawn() -> None:
    made = scene(AHEAD)
    found = pictures(made).draw(1.0, ego_at(8.0), [Shifted(0, 1.0, False)])
    np.testing.assert_array_equal(found[0], rendered(made.without(0), 1.0, ego_at(8.0)))


def test_the_same_time_is_computed_once_and_little_is_kept() -> None:
    made = scene(AHEAD)
    drawn = pictures(made, PictureOptions(least_weight=0.0, cache_mb=44 * 60 * 3 / 1e6))
    first = drawn.draw(1.0, ego_at(8.0))
    assert list(drawn._kept) == [1.0]
    for time_s in (1.1, 1.2, 1.0, 1.3):
        drawn.draw(time_s, ego_at(8.0))
    assert list(drawn._kept) == [1.2, 1.0, 1.3]
    np.testing.assert_array_equal(drawn.draw(1.0, ego_at(8.0)), first)
    nothing = pictures(made, PictureOptions(least_weight=0.0, cache_mb=0.0))
    np.testing.assert_array_equal(nothing.draw(1.0, ego_at(8.0)), first)
    assert not nothing._kept


def test_any_mount_will_do() -> None:
    made = scene(AHEAD)
    drawn = Pictures(
        made, [mount("left", left_deg=60, size_px=SIZE), mount("wide", hfov_deg=100, size_px=SIZE)], ALL
    )
    one, two = drawn.draw(0.5, ego_at(4.0))
    assert np.abs(one.astype(float) - two).mean() > 5


def test_threads_are_those_of_the_core() -> None:
    before = threads()
    try:
        pictures(scene(), PictureOptions(threads=1))
        assert threads() == 1
    finally:
        set_threads(before)


@pytest.mark.parametrize("wrong", [{"least_weight": 0.9}, {"cache_mb": -1.0}, {"threads": 0}])
def test_options_of_no_use_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="expected"):
        PictureOptions(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("least_weight", [0.0, 0.02])
def test_on_another_device_they_are_nearly_the_same(
    least_weight: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, options = two_cameras(scene(AHEAD, ONCOMING)), PictureOptions(least_weight=least_weight)
    late = (Shifted(0, 0.5, True), Shifted(1, 0.0, False))
    splat_there(monkeypatch)
    copies = copies_to_the_cpu(monkeypatch)
    with pretending() as device:
        monkeypatch.setattr(module, "device_of", lambda name, why: device)
        there = pictures(made, options, only_front=False)
        there.leave_out([ego_at(0.0), ego_at(8.0)])
        copies.clear()
        found = [there.draw(1.0, ego_at(8.0), shifted) for shifted in ((), late)]
        assert copies == [(40, 64, 3)] * 4
    monkeypatch.undo()
    here = pictures(made, options, only_front=False)
    here.leave_out([ego_at(0.0), ego_at(8.0)])
    for pictures_there, shifted in zip(found, ((), late), strict=True):
        off = here.draw(1.0, ego_at(8.0), shifted).astype(int) - pictures_there
        assert abs(off).max() <= 1
