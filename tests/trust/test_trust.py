"""What was seen well is trusted more than what was not: from aside, up close, behind, fitted badly."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.scene.actor import Actor, Track
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.trajectory import Trajectory
from dreamdrive.splat import render
from dreamdrive.trust import (
    FALL_DB,
    LEAST_DB,
    RISING,
    SceneTrust,
    error_network,
    expected_db,
    fall_m,
    reach_m,
    within_trust,
)
from dreamdrive.trust.evidence import asked_views, evidence_of, seen_with
from dreamdrive.trust.free_space import FreeSpace
from dreamdrive.vision.residual import BLOCK_PX, blocks, residual_of
from tests.walls import CAMERA, HIGH, WIDE, board, pose_at, street


@pytest.fixture(scope="module")
def trust() -> SceneTrust:
    return SceneTrust.of(street())


def test_the_farther_aside_the_less_it_is_trusted(trust: SceneTrust) -> None:
    told = [trust.view(trust.scene.cameras[3].moved(metres), 0.3).psnr_db for metres in (0, 0.5, 1, 2, 4)]
    assert told == sorted(told, reverse=True)
    assert told[0] > told[-1] + 3


def test_what_fitted_badly_is_trusted_less(trust: SceneTrust) -> None:
    worse = SceneTrust.of(street(residual=0.1))
    camera = trust.scene.cameras[3]
    assert worse.view(camera, 0.3).psnr_db < trust.view(camera, 0.3).psnr_db - 3
    assert (worse.view(camera, 0.3).trust < trust.view(camera, 0.3).trust).all()


def test_what_a_view_that_no_fit_has_seen_is_off_counts_for_all_others() -> None:
    scene = street(held_out=(2, 5))
    assert scene.residual is not None
    off = scene.residual.copy()
    off[2] = 0.2
    one, both = SceneTrust.of(scene), SceneTrust.of(replace(scene, residual=off))
    camera = scene.cameras[3]
    assert set(one.off) == {2, 5}
    # Ten times the error in one of two such views: the geometric mean is ten times larger in its square.
    ratio = both.view(camera, 0.3).squared_error / one.view(camera, 0.3).squared_error
    np.testing.assert_allclose(ratio, 10.0, rtol=0.02)
    np.testing.assert_allclose(
        both.view(camera, 0.3, besides=2).squared_error, one.view(camera, 0.3, besides=2).squared_error
    )


def test_evidence_counts_pixels_and_knows_directions() -> None:
    scene = street()
    assert scene.residual is not None
    evidence = evidence_of(scene, np.square(scene.residual.astype(np.float32)))
    # Each view is covered by the wall: what its Gaussians add makes up all of the views.
    shown = sum(float(render(scene.static, camera).alpha.sum()) for camera in scene.cameras)
    assert float(evidence.weight_px.sum()) == pytest.approx(shown, rel=1e-3)
    seen = evidence.weight_px > 1
    torch.testing.assert_close(
        evidence.error[seen], torch.full((int(seen.sum()),), 0.02**2), rtol=2e-2, atol=0
    )
    middle = int(scene.static.means[:, :2].norm(dim=1).argmin())
    assert evidence.sees[middle].all()
    assert float(evidence.nearest_m[middle]) == pytest.approx(14 - 3.5, rel=1e-3)
    towards = -scene.static.means[middle] / scene.static.means[middle].norm()
    torch.testing.assert_close(evidence.directions[middle, 0], towards, rtol=1e-4, atol=1e-4)


def test_what_was_filled_in_counts_as_never_seen() -> None:
    scene = street()
    guessed = replace(
        scene, static=replace(scene.static, filled=torch.ones(len(scene.static), dtype=torch.bool))
    )
    evidence = evidence_of(guessed, np.zeros((8, HIGH // BLOCK_PX, WIDE // BLOCK_PX), np.float32))
    assert not evidence.sees.any()
    camera = scene.cameras[3]
    assert (
        SceneTrust.of(guessed).view(camera, 0.3).psnr_db < SceneTrust.of(scene).view(camera, 0.3).psnr_db - 3
    )


def test_angles_and_closeness_of_a_view(trust: SceneTrust) -> None:
    camera = CAMERA.at(pose_at(7.0)).moved(3.0)
    _, told = seen_with(trust.evidence, trust.scene, camera, 0.0)
    error, unseen, angle, closer, _ = told[HIGH // 2, WIDE // 2].tolist()
    # In the middle is what is straight ahead, 3 m to the right: seen from the path under atan(3 / 14).
    assert angle == pytest.approx(np.arctan(3 / 14), abs=0.02)
    assert closer == pytest.approx(np.log(np.hypot(10.5, 3) / 7), abs=0.05)
    assert error == pytest.approx(0.02, rel=0.02)
    assert unseen < 0.01


def test_directions_turn_with_what_moves() -> None:
    """A board that turns on a table shows the camera the same side again only where it turned back."""
    still = street()
    turned = replace(
        still.static,
        quaternions=torch.tensor([[np.cos(0.3), 0, np.sin(0.3), 0]]).float().repeat(len(still.static), 1),
    )
    moving = replace(
        still,
        static=still.static.select(torch.zeros(0, dtype=torch.int64)),
        dynamic=replace(turned, actor=torch.zeros(len(turned), dtype=torch.int64)),
        actors=(
            Actor(
                0,
                "actor 0",
                "vehicle",
                len(turned),
                Track(np.array([0.0, 0.7]), np.zeros((2, 3)), np.zeros(2)),
            ),
        ),
    )
    evidence = evidence_of(moving, np.zeros((8, HIGH // BLOCK_PX, WIDE // BLOCK_PX), np.float32))
    middle = int(turned.means[:, :2].norm(dim=1).argmin())
    # Quaternion wxyz: turned by 0.6 about y; its own axes see the camera at -z turned back.
    expected = torch.tensor([np.sin(0.6), 0.0, -np.cos(0.6)]).float()
    torch.testing.assert_close(evidence.directions[middle, 0], expected, rtol=0, atol=0.03)


def test_no_view_looked_behind_or_beside() -> None:
    scene = street()
    space = FreeSpace.of(scene)
    on_path = space.hidden(scene.cameras[3], render(scene.static, scene.cameras[3]).expected_depth_m())
    assert float(on_path.mean()) < 0.05
    beside = scene.cameras[0].moved(6.0)
    depth_m = render(scene.static, beside).expected_depth_m()
    far = space.hidden(beside, depth_m)
    # To the right nothing was looked into until far ahead.
    assert float(far[:, -1].mean()) > 0.8
    assert float(far.mean()) > float(on_path.mean()) + 0.4
    behind = replace(
        scene, static=Gaussians.concatenate(scene.static, board(6.0, (-3, 3), (-3, 3), 0.2, seed=1))
    )
    through = FreeSpace.of(behind).hidden(scene.cameras[0], depth_m=torch.full((HIGH, WIDE), 14.0))
    seen = FreeSpace.of(behind).hidden(scene.cameras[0], depth_m=torch.full((HIGH, WIDE), 6.0))
    middle = (HIGH // BLOCK_PX // 2, WIDE // BLOCK_PX // 2)
    assert float(through[middle]) > float(seen[middle]) + 0.1


def test_more_of_what_counts_against_a_block_never_helps() -> None:
    rng = np.random.default_rng(0)
    network = error_network()
    features = network.mean + network.deviation * rng.normal(size=(200, len(RISING)))
    base = network.squared_error(features)
    assert ((base > 0) & (base < 0.15)).all()
    for k, rises in enumerate(RISING):
        more = features.copy()
        more[:, k] += network.deviation[k]
        if rises:
            assert (network.squared_error(more) >= base).all()


def test_where_a_drive_is_no_longer_good(trust: SceneTrust) -> None:
    assert fall_m((0, 1, 2), (30.0, 28.0, 24.0)) == pytest.approx(1.25)
    assert fall_m((0, 1, 2), (30.0, 29.0, 28.0)) is None
    expected = partial(expected_db, trust)
    left, right = reach_m(expected, -1), reach_m(expected, 1)
    assert 0.05 < right < 8
    assert left == pytest.approx(right, rel=0.2)  # the wall is as wide to both sides


def test_views_are_asked_evenly_and_of_each_camera() -> None:
    scene = street(held_out=(0,))
    assert asked_views(scene, 3) == [1, 4, 7]
    rig = replace(scene, camera=np.array([0, 1] * 4))
    assert {int(view) % 2 for view in asked_views(rig, 2)} == {0, 1}


def test_residuals_are_of_blocks() -> None:
    shown = np.zeros((17, 24, 3), np.float32)
    frame = np.zeros((17, 24, 3), np.uint8)
    frame[8:16, 16:24] = 51
    found = residual_of(shown, frame)
    assert found.shape == (2, 3)
    np.testing.assert_allclose(found, [[0, 0, 0], [0, 0, 0.2]], atol=1e-3)
    assert blocks(np.ones((16, 16, 2), np.float32)).shape == (2, 2, 2)


def test_a_scene_without_frames_says_so() -> None:
    with pytest.raises(InputError, match="generate it again"):
        SceneTrust.of(replace(street(), residual=None))


def test_a_drive_is_bent_to_where_it_can_be_believed(trust: SceneTrust) -> None:
    recorded = trust.scene.trajectory
    assert within_trust(trust, recorded, recorded) is recorded
    poses = recorded.world_from_camera.copy()
    poses[4:, 0, 3] += 4.0
    asked = Trajectory(poses, recorded.times_s)
    bent = within_trust(trust, asked, recorded)
    np.testing.assert_array_equal(bent.times_s, asked.times_s)
    np.testing.assert_allclose(bent.positions_m[:3], recorded.positions_m[:3], atol=1e-9)
    assert 0 < bent.positions_m[-1, 0] < 3.9
    for view, t_s in ((5, 0.5), (7, 0.7)):
        camera = trust.scene.cameras[view]
        least_db = min(LEAST_DB, trust.view(camera, t_s).psnr_db - FALL_DB)
        assert trust.view(camera.at(bent.world_from_camera[view]), t_s).psnr_db >= least_db - 0.01
        assert trust.view(camera.at(asked.world_from_camera[view]), t_s).psnr_db < least_db
