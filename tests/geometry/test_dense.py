"""The dense half as a whole: what it may look at, what stays empty, what is taken as given."""

import cv2
import numpy as np
import pytest

from dreamdrive.compute import threads
from dreamdrive.geometry.dense import densify
from dreamdrive.geometry.moving import FLAGGED
from dreamdrive.scene.street.street_class import StreetClass
from tests.geometry import toy
from tests.scene.street.test_look import small_look


@pytest.fixture(scope="module")
def held() -> toy.Toy:
    return toy.drive([toy.Box(9, -0.9, 0.8)], count=5, held_out=(3,), fixed_rows=12)


def test_held_out_frames_and_fixed_regions_stay_empty(held):
    dense = densify(held.clip, held.posed)
    for values in (dense.depth_m, dense.confidence, dense.moving, dense.sky):
        assert not values[3].any()
        assert not values[:, -12:].any()
    assert (dense.depth_m[2] > 0).mean() > 0.5
    assert dense.confidence.min() >= 0
    assert dense.confidence.max() <= 1
    assert not dense.confidence[dense.depth_m == 0].any()
    assert not dense.depth_m[dense.sky].any()


def test_held_out_pixels_have_no_influence(held):
    frames = held.clip.frames.copy()
    frames[3] = np.random.default_rng(0).integers(0, 255, frames[3].shape)
    changed = densify(toy.replace(held.clip, frames=frames), held.posed)
    plain = densify(held.clip, held.posed)
    for name in ("depth_m", "confidence", "moving", "sky"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(changed, name))


@pytest.mark.slow
def test_threads_do_not_change_the_result_and_opencv_keeps_its_setting(held, monkeypatch):
    before = cv2.getNumThreads()
    both = densify(held.clip, held.posed)
    assert cv2.getNumThreads() == before
    monkeypatch.setattr(threads, "THREADS", 1)
    alone = densify(held.clip, held.posed)
    np.testing.assert_array_equal(both.depth_m, alone.depth_m)
    np.testing.assert_array_equal(both.moving, alone.moving)


def test_invalid_pixels_have_no_depth(held):
    valid = held.clip.valid.copy()
    valid[:, :, :20] = False
    dense = densify(toy.replace(held.clip, valid=valid), held.posed)
    assert not dense.depth_m[:, :, :20].any()
    assert not dense.confidence[:, :, :20].any()


def test_given_depth_and_sky_are_used():
    street = toy.drive([], count=3)
    given = street.depth_m.copy()
    given[:, 60:70, 60:70] = 0
    sky = np.zeros(given.shape, bool)
    sky[:, :10] = True
    known = toy.replace(street.clip.known, depth_m=given, sky=sky)
    dense = densify(toy.replace(street.clip, known=known), street.posed)
    shown = (given > 0) & ~sky
    np.testing.assert_allclose(dense.depth_m[shown], given[shown], rtol=1e-5)
    assert (dense.confidence[shown] == 1).all()
    assert not dense.depth_m[:, 60:70, 60:70].any()
    np.testing.assert_array_equal(dense.sky, sky)


def test_single_points_of_lidar_are_kept_and_the_rest_is_found_as_without_them():
    street = toy.drive([toy.Box(9, -0.9, 0.8)], count=3, held_out=(1,))
    clip = street.clip
    points = np.zeros(street.depth_m.shape, np.float32)
    points[:, ::6, ::6] = street.depth_m[:, ::6, ::6] * np.float32(1.02)
    points[2] = 0  # not every frame has a sweep
    known = toy.replace(clip.known, depth_m=points)
    plain = densify(clip, street.posed)
    dense = densify(toy.replace(clip, known=known), street.posed)
    for frame in (0, 2):
        assert (dense.depth_m[frame] > 0).mean() >= (plain.depth_m[frame] > 0).mean() > 0.5
    assert not dense.depth_m[1].any()
    there = (points[0] > 0) & (dense.depth_m[0] > 0) & (dense.moving[0] < FLAGGED)
    assert there.mean() > 0.01
    assert (np.abs(dense.depth_m[0] / np.where(there, points[0], 1) - 1)[there] < 1e-3).mean() > 0.9


def test_a_standing_clip_gets_plane_and_backdrop_little_trusted():
    street = toy.drive([], count=4, step_m=0)
    dense = densify(street.clip, street.posed)
    assert 0 < dense.confidence.max() <= 0.3
    road = dense.depth_m[1, -20:, 100:156]
    np.testing.assert_allclose(road, street.depth_m[1, -20:, 100:156], rtol=1e-3)
    assert np.isclose(dense.depth_m[1][~dense.sky[1]].max(), 40.0, rtol=1e-4)


def test_poses_of_the_fallback_give_no_evidence_of_motion():
    street = toy.drive([toy.Box(9, -0.9, 0.8)], count=4)
    posed = toy.replace(street.posed, fallback="structure from motion was refused")
    dense = densify(street.clip, posed)
    assert not dense.moving.any()
    assert 0 < dense.confidence.max() <= 0.3


def test_a_single_frame_and_a_missing_ground_are_no_error():
    street = toy.drive([], count=1)
    alone = densify(street.clip, street.posed)
    assert not alone.confidence.any()
    pair = toy.drive([], count=2)
    dense = densify(pair.clip, toy.replace(pair.posed, ground=None))
    assert (dense.depth_m > 0).mean() > 0.3


def test_with_given_depth_a_road_user_moves_as_a_whole():
    street = toy.drive([toy.Box(12, -0.9, 0.4)])
    known = toy.replace(street.clip.known, depth_m=street.depth_m)
    clip, zeros = toy.replace(street.clip, known=known), np.zeros(street.box.shape, np.float32)
    small = small_look(len(clip))
    look = toy.replace(
        small,
        depth=zeros,
        spread=zeros.astype(np.float16),
        classes=np.where(street.box, StreetClass.VEHICLE, StreetClass.ROAD).astype(np.uint8),
        confidence=np.ones(street.box.shape, np.float16),
        instances=street.box.astype(np.uint16),
    )
    parts = densify(clip, street.posed)
    whole = densify(toy.replace(clip, looks=(look,)), street.posed)
    assert parts.road_users is None
    assert (parts.moving[street.box] >= FLAGGED).mean() < 0.9
    assert whole.road_users is not None
    assert (whole.moving[street.box] >= FLAGGED).all()
    assert not (whole.moving[~street.box] >= FLAGGED).any()
    shown = parts.depth_m > 0
    np.testing.assert_array_equal(whole.depth_m[shown], parts.depth_m[shown])


def test_depth_of_stereo_alone_stands_beside_depth_that_a_network_has_a_part_in(held):
    zeros = np.zeros(held.box.shape, np.float32)
    look = toy.replace(
        small_look(len(held.clip)),
        depth=np.full(held.box.shape, 3.0, np.float32),
        spread=np.full(held.box.shape, 0.2, np.float16),
        classes=np.full(held.box.shape, StreetClass.STRUCTURE, np.uint8),
        confidence=np.ones(held.box.shape, np.float16),
        instances=zeros.astype(np.uint16),
        road_users=((),) * len(held.clip),
    )
    camera = held.clip.rig[0]
    size = {"width_px": camera.width_px, "height_px": camera.height_px, "focal_px": camera.fx_px}
    seen = toy.replace(look.camera, **size)
    look = toy.replace(look, camera=seen, cameras=(seen,) * len(held.clip))
    fused = densify(toy.replace(held.clip, looks=(look,)), held.posed)
    stereo = densify(held.clip, held.posed)
    assert stereo.stereo_ratio is None
    assert fused.stereo_ratio is not None
    assert fused.stereo_confidence is not None
    depth_m, confidence = fused.stereo_ratio * fused.depth_m, fused.stereo_confidence
    still = (fused.moving < FLAGGED) & (stereo.moving < FLAGGED) & (stereo.depth_m > 0) & ~fused.sky
    # Not to the last pixel: the sky that the sweep leaves out is the look's.
    assert (np.abs(np.log(depth_m[still] / stereo.depth_m[still])) < 0.05).mean() > 0.8
    assert (np.abs(confidence - stereo.confidence)[still] < 0.05).mean() > 0.8
    assert (np.abs(np.log(fused.depth_m[still] / depth_m[still])) > 0.05).mean() > 0.02
