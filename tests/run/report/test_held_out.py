"""Likeness and the predictions that need no scene."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.run.report.held_out import BASELINES, interpolate_flow, likeness, score_baselines
from tests.rigs import rig_clip
from tests.streets import small_street, street_clip, true_geometry


def test_likeness_of_equal_images_is_the_best_there_is() -> None:
    frame = np.random.default_rng(0).integers(0, 255, (24, 32, 3), np.uint8)
    found = likeness(frame / 255.0, frame, np.ones((24, 32), bool))
    assert found.psnr == 100
    assert found.ssim == pytest.approx(1, abs=1e-6)


def test_likeness_has_the_textbook_value() -> None:
    frame = np.full((24, 32, 3), 100, np.uint8)
    assert likeness(frame / 255 + 0.1, frame, np.ones((24, 32), bool)).psnr == pytest.approx(
        -20 * np.log10(26 / 255), abs=1e-3
    )


def test_only_the_mask_counts() -> None:
    rng = np.random.default_rng(0)
    frame = rng.integers(0, 255, (40, 64, 3), np.uint8)
    image = np.clip(frame / 255 + rng.normal(0, 0.1, frame.shape), 0, 1)
    half = np.zeros((40, 64), bool)
    half[:, :32] = True
    spoiled = image.copy()
    spoiled[:, 32:] = 0
    assert likeness(spoiled, frame, half) == likeness(image, frame, half)
    whole = likeness(image, frame, np.ones((40, 64), bool))
    assert likeness(image, frame, half).psnr == pytest.approx(whole.psnr, abs=0.5)
    assert likeness(image, frame, half).ssim == pytest.approx(whole.ssim, abs=0.05)
    with pytest.raises(ValueError, match="no pixel"):
        likeness(image, frame, np.zeros((40, 64), bool))


def test_baselines_see_only_training_frames() -> None:
    street = small_street(frames=7)
    clip = street_clip(street, hold_out=3)
    assert np.flatnonzero(clip.held_out).tolist() == [1, 4]
    black = clip.frames.copy()
    black[clip.held_out] = 0
    blind = replace(clip, frames=black)
    for predict in BASELINES.values():
        for frame in (1, 4):
            assert (predict(clip, frame) == predict(blind, frame)).all()


def test_baselines_rank_as_they_should() -> None:
    street = small_street(frames=6, size=(160, 96), movers=0)
    clip = street_clip(street, hold_out=3)
    scores = score_baselines(clip, true_geometry(street))
    means = {name: np.mean([s.psnr for s in one.values()]) for name, one in scores.items()}
    assert means["flow_interpolation"] > means["average_neighbours"] > means["repeat_previous"]


def test_flow_interpolation_meets_a_moving_picture_half_way() -> None:
    rng = np.random.default_rng(1)
    import cv2

    wide = cv2.GaussianBlur(rng.integers(0, 255, (96, 200, 3)).astype(np.float32), (0, 0), 3)
    wide = np.clip((wide - wide.mean()) * 4 + 128, 0, 255).astype(np.uint8)
    street = small_street(frames=3, size=(160, 96))
    frames = np.stack([wide[:, 4 * i : 4 * i + 160] for i in range(3)])
    clip = replace(street_clip(street, hold_out=2), frames=frames)
    error = np.abs(interpolate_flow(clip, 1) - frames[1] / 255)[16:-16, 16:-16]
    assert error.mean() < 0.01


def test_frames_are_predicted_from_their_own_camera() -> None:
    clip = rig_clip()
    before = BASELINES["repeat_previous"](clip, 5)
    np.testing.assert_allclose(before, clip.frames[3] / 255, atol=1e-6)
