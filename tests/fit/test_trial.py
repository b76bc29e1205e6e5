"""The small fit by which frames judge, on the sliding wall and on a wall that stands."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.fit import SeedOptions, TrialOptions, better_depth, trial
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from tests.decompose.test_per_frame import DEPTH_M, wall

OPTIONS = TrialOptions(visits=8.0)


def standing_wall() -> tuple[Clip, Geometry]:
    """The same pictures, and cameras that move as they do: 3 px a frame to the right."""
    clip, geometry = wall(held_out=None)
    cameras: list[Camera] = []
    for frame, camera in enumerate(geometry.cameras):
        pose = np.eye(4)
        pose[0, 3] = 3 * frame * DEPTH_M / camera.fx_px
        cameras.append(camera.at(pose))
    return clip, replace(geometry, cameras=tuple(cameras))


def test_a_right_path_predicts_withheld_frames_and_a_wrong_one_does_not() -> None:
    errors = []
    for clip, geometry in (standing_wall(), wall(held_out=None)):
        found = trial(clip, geometry, SeedOptions(), OPTIONS, 0)
        assert found is not None
        assert found.frames == (2, 6)
        assert found.clip.held_out.nonzero()[0].tolist() == [2, 6]
        errors.append(found.errors[:, 8:-8, 20:-20].mean())
    assert errors[0] < 0.5 * errors[1]


def test_withheld_frames_are_not_read() -> None:
    clip, geometry = standing_wall()
    first = trial(clip, geometry, SeedOptions(), OPTIONS, 0)
    frames = clip.frames.copy()
    frames[2] = 255 - frames[2]
    second = trial(replace(clip, frames=frames), geometry, SeedOptions(), OPTIONS, 0)
    assert first is not None
    assert second is not None
    assert second.errors[1] == pytest.approx(first.errors[1], abs=1e-6)
    assert second.errors[0].mean() > 2 * first.errors[0].mean()


def test_pictures_of_a_trial_are_small_and_what_moves_does_not_count() -> None:
    clip, geometry = standing_wall()
    moving = np.zeros_like(geometry.moving)
    moving[:, 40:] = 1
    small = replace(OPTIONS, width_px=48)
    found = trial(clip, replace(geometry, moving=moving), SeedOptions(), small, 0)
    assert found is not None
    assert found.clip.size == (48, 32)
    assert found.errors.shape == found.judged.shape == (2, 32, 48)
    assert found.judged[:, :19].all()
    assert not found.judged[:, 21:].any()


def test_too_few_frames_say_nothing() -> None:
    clip, geometry = wall(held_out=None)
    alone = replace(clip, held_out=np.arange(len(clip)) > 1)
    for withheld in (2, 8):  # one is left to fit, and none to judge
        assert trial(alone, geometry, SeedOptions(), replace(OPTIONS, withheld=withheld), 0) is None


def with_two_depths(first: float, second: float) -> tuple[Clip, Geometry]:
    """The standing wall, at depths that are so many times the true one."""
    clip, geometry = standing_wall()
    depth_m = geometry.depth_m
    ratio, trust = np.full_like(depth_m, second / first), np.full_like(depth_m, 0.9)
    return clip, replace(geometry, depth_m=first * depth_m, stereo_ratio=ratio, stereo_confidence=trust)


@pytest.mark.parametrize(("fused", "stereo", "taken"), [(1.0, 2.0, "fused"), (2.0, 1.0, "stereo")])
def test_the_depth_that_predicts_withheld_frames_is_taken(fused: float, stereo: float, taken: str) -> None:
    clip, geometry = with_two_depths(fused, stereo)
    chosen, found = better_depth(clip, geometry, SeedOptions(), OPTIONS, 0, lambda found: True)
    assert found is not None
    assert found.psnr_db >= max(chosen.details["depth_trial_db"].values()) - 0.01
    assert chosen.stereo_ratio is None
    assert chosen.stereo_confidence is None
    assert chosen.details["depth"] == taken
    scores = chosen.details["depth_trial_db"]
    other = "fused" if taken == "stereo" else "stereo"
    assert scores[taken] > scores[other] + OPTIONS.stereo_db
    np.testing.assert_allclose(chosen.depth_m, standing_wall()[1].depth_m, rtol=1e-6)
    assert (chosen.confidence == np.float32(0.9)).all() == (taken == "stereo")


def test_without_a_clear_gain_or_a_second_depth_nothing_changes() -> None:
    clip, geometry = with_two_depths(1.0, 1.0)
    found, tried = better_depth(clip, geometry, SeedOptions(), OPTIONS, 0, lambda found: True)
    assert tried is not None
    assert found.details["depth"] == "fused"
    alone = replace(geometry, stereo_ratio=None)
    same, untried = better_depth(clip, alone, SeedOptions(), OPTIONS, 0, lambda found: True)
    assert same.details == geometry.details
    assert untried is None


def test_where_no_street_stands_stereo_is_not_taken() -> None:
    clip, geometry = with_two_depths(2.0, 1.0)
    found, _ = better_depth(clip, geometry, SeedOptions(), OPTIONS, 0, lambda found: False)
    assert found.details["depth"] == "fused"
    np.testing.assert_array_equal(found.depth_m, geometry.depth_m)


def test_where_road_users_are_known_only_they_are_left_out() -> None:
    clip, geometry = standing_wall()
    moving, road_users = np.zeros_like(geometry.moving), np.zeros(geometry.moving.shape, np.uint16)
    moving[:, :, 60:] = 1
    road_users[:, :, 80:] = 1
    found = trial(clip, replace(geometry, moving=moving, road_users=road_users), SeedOptions(), OPTIONS, 0)
    assert found is not None
    assert found.judged[:, :, :79].all()
    assert not found.judged[:, :, 81:].any()


def test_what_drives_before_the_street_does_not_hide_it() -> None:
    clip, geometry = standing_wall()
    frames, depth_m, moving = clip.frames.copy(), geometry.depth_m.copy(), np.zeros_like(geometry.moving)
    for i in range(len(clip)):
        box = np.s_[i, 16:40, 20 + 6 * i : 44 + 6 * i]
        frames[box], depth_m[box], moving[box] = 255, DEPTH_M / 2, 1
    plain = trial(clip, geometry, SeedOptions(), OPTIONS, 0)
    found = trial(
        replace(clip, frames=frames),
        replace(geometry, depth_m=depth_m, moving=moving),
        SeedOptions(),
        OPTIONS,
        0,
    )
    assert plain is not None
    assert found is not None
    assert found.psnr_db > plain.psnr_db - 1
