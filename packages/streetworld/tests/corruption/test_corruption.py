"""Corruptions of frames: what is off leaves no trace, the same seed the same frames, more is more."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive.scene.street.truth import DriveTruth
from streetworld import make_street
from streetworld.corruption import Corruption, corrupt, parse_corruption
from streetworld.corruption.effects import Noise, slide, wobble
from streetworld.corruption.settings import STRENGTHS


@pytest.fixture(scope="module")
def street() -> DriveTruth:
    return make_street(seed=2, frames=6, size=(160, 96))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.square(values, dtype=np.float64).mean()))


def change(street: DriveTruth, corruption: Corruption) -> np.ndarray:
    corrupted = corrupt(street.frames, corruption, street.depth_m)
    return corrupted.astype(np.float64) - street.frames


def displacement_px(clean: np.ndarray, corrupted: np.ndarray) -> np.ndarray:
    """Lengths of the dense flow between two frames."""
    grey = [cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY) for frame in (clean, corrupted)]
    start = np.zeros((*clean.shape[:2], 2), np.float32)
    method = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    return np.linalg.norm(method.calc(*grey, start), axis=-1)


def test_off_leaves_every_bit(street: DriveTruth) -> None:
    corrupted = corrupt(street.frames, Corruption(seed=5))
    np.testing.assert_array_equal(corrupted, street.frames)
    corrupted[:] = 0
    assert street.frames.any()


@pytest.mark.parametrize("name", STRENGTHS)
def test_each_is_a_function_of_the_seed(street: DriveTruth, name: str) -> None:
    corruption = Corruption(**{name: 0.5}, seed=1)
    first = corrupt(street.frames, corruption, street.depth_m)
    np.testing.assert_array_equal(first, corrupt(street.frames, corruption, street.depth_m))
    assert (first != corrupt(street.frames, replace(corruption, seed=2), street.depth_m)).any()


def test_a_longer_clip_begins_with_the_same_frames(street: DriveTruth) -> None:
    corruption = parse_corruption("generated", seed=3)
    whole = corrupt(street.frames, corruption, street.depth_m)
    np.testing.assert_array_equal(corrupt(street.frames[:4], corruption, street.depth_m[:4]), whole[:4])


@pytest.mark.parametrize("name", STRENGTHS)
def test_more_strength_changes_more(street: DriveTruth, name: str) -> None:
    sizes = [rms(change(street, Corruption(**{name: s}))) for s in (0.0, 0.25, 0.5, 1.0)]
    assert sizes[0] == 0
    assert (np.diff(sizes) > 0.15).all(), sizes


@pytest.mark.parametrize("name", ["warp", "far"])
def test_more_strength_moves_pixels_farther(street: DriveTruth, name: str) -> None:
    moved = [
        displacement_px(
            street.frames[2],
            corrupt(street.frames[:3], Corruption(**{name: s}), street.depth_m[:3])[2],
        ).mean()
        for s in (0.25, 0.5, 1.0)
    ]
    assert moved[0] > 0.1
    assert moved[1] > 1.4 * moved[0]
    assert moved[2] > 1.4 * moved[1]


def test_warp_measures_out_as_its_docstring_says() -> None:
    fields = np.array([[wobble(seed, f, 96, 160) for f in range(0, 24, 4)] for seed in range(20)])
    length = np.linalg.norm(fields, axis=2)
    assert rms(length) == pytest.approx(1.9 / 2, rel=0.05)
    assert rms(np.linalg.norm(fields[:, 2:] - fields[:, :-2], axis=2)) == pytest.approx(2.0 / 2, rel=0.1)


def test_the_far_slides_and_the_near_stays() -> None:
    def size(depth: float) -> float:
        flat = np.full((96, 160), depth, np.float32)
        fields = np.array([[slide(seed, f, flat) for f in range(0, 24, 6)] for seed in range(20)])
        return rms(np.linalg.norm(fields, axis=2))

    near, middle, sky = size(5.0), size(25.0), size(0.0)
    assert near < 0.05 * sky
    assert middle == pytest.approx(sky / 2, rel=1e-3)
    assert sky == pytest.approx(4.4 / 2, rel=0.15)


def test_far_leaves_the_near_road_alone(street: DriveTruth) -> None:
    difference = np.abs(change(street, Corruption(far=1.0))).mean(axis=-1)
    near = (street.depth_m > 0) & (street.depth_m < 6)
    assert difference[near].mean() < 0.25 * difference[~near].mean()


def test_flicker_moves_the_mean_of_frames_and_drift_does_so_slowly(street: DriveTruth) -> None:
    flicker = change(street, Corruption(flicker=1.0)).mean(axis=(1, 2, 3))
    drift = change(street, Corruption(drift=1.0)).mean(axis=(1, 2, 3))
    assert rms(np.diff(flicker)) > 2
    assert drift[0] == 0
    assert rms(np.diff(drift)) < 0.25 * rms(np.diff(flicker))


def test_shimmer_swims_in_texture_and_spares_plain_surfaces() -> None:
    rng = np.random.default_rng(0)
    frame = np.full((96, 160, 3), 120, np.uint8)
    frame[:, 80:] = rng.integers(60, 180, (96, 80, 1), np.uint8)
    first, second = corrupt(np.stack([frame, frame]), Corruption(shimmer=1.0)).astype(np.float64)
    assert np.abs(first[:, :70] - 120).max() <= 1
    assert rms(first[:, 90:] - frame[:, 90:]) > 10
    assert rms(second[:, 90:] - first[:, 90:]) > 3


def test_noise_has_unit_size_and_the_same_shape_at_every_size_of_picture() -> None:
    fields = np.array(
        [[Noise(seed, 0, 2, 6, 8).field(f, 48, 80) for f in range(0, 16, 5)] for seed in range(60)]
    )
    assert rms(fields) == pytest.approx(1, abs=0.05)
    small, large = (Noise(1, 0, 1, 6, 8).field(3, 48 * scale, 80 * scale)[0] for scale in (1, 4))
    np.testing.assert_allclose(cv2.resize(large, (80, 48), interpolation=cv2.INTER_AREA), small, atol=0.01)


def test_noise_is_smooth_across_its_knots() -> None:
    noise = Noise(4, 0, 1, 6, hold=4)
    fields = np.array([noise.field(f, 24, 40) for f in range(13)])
    steps = [rms(step) for step in np.diff(fields, axis=0)]
    assert max(steps) < 4 * np.median(steps)


def test_text_names_strengths_and_presets() -> None:
    assert parse_corruption("warp=0.5, flicker=1", seed=7) == Corruption(warp=0.5, flicker=1, seed=7)
    assert parse_corruption("generated") == Corruption(0.5, 0.5, 0.5, 0.5, 0.5)
    assert parse_corruption("generated,far=0") == Corruption(0.5, 0.5, 0.5, 0.5, 0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("wrap=1", "'wrap=1': expected warp=STRENGTH, shimmer=STRENGTH"),
        ("", "or generated, between commas"),
        ("warp", "'warp': expected"),
        ("generated=1", "'generated=1': expected"),
        ("warp=", "warp=: expected a number"),
        ("warp=much", "warp=much: expected a number"),
        ("flicker=-1", "flicker=-1: expected a strength from 0"),
        ("drift=nan", "drift=nan: expected a strength from 0"),
    ],
)
def test_other_text_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_corruption(text)


def test_a_negative_seed_is_refused() -> None:
    with pytest.raises(InputError, match="seed is -1"):
        Corruption(seed=-1)


def test_far_without_depth_is_refused(street: DriveTruth) -> None:
    with pytest.raises(InputError, match="add far=0"):
        corrupt(street.frames, parse_corruption("generated"))
