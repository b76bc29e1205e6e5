"""Focal lengths from pointmaps."""

import numpy as np
import pytest

from dreamdrive.geometry.backends.dust3r.align.focal import focal_votes, robust_px, weiszfeld_px
from dreamdrive.geometry.backends.dust3r.align.graph import graph_of
from dreamdrive.geometry.measured import weighted_median
from dreamdrive_bench.geometry.simulated_pairs import Noise, pair_maps
from tests.geometry.backends.dust3r.align.pairs import street, window
from tests.golden.reading import arrays, cases, values

LIMIT = 1e-5
"""Relative: ten steps of a weighted mean over all pixels, which the authors' program adds up in float32."""


@pytest.mark.parametrize("case", cases("dust3r/weiszfeld.json"))
def test_the_papers_rule_is_golden(case: str) -> None:
    wanted = values("dust3r/weiszfeld.json")[case]
    points = arrays("dust3r/weiszfeld_inputs.safetensors")[case]
    principal = tuple(wanted["pp"])
    assert weiszfeld_px(points, principal) == pytest.approx(wanted["weiszfeld"], rel=LIMIT)


def test_a_fifth_of_gross_outliers_moves_the_robust_rule_by_little() -> None:
    random = np.random.default_rng(0)
    points = _plane(40, 24, 36.0) * random.normal(1, 0.02, (24, 40, 3)).astype(np.float32)
    wrong = random.random((24, 40)) < 0.2
    points[wrong] = random.normal(size=(wrong.sum(), 3)) * [20, 20, 5]
    assert abs(weiszfeld_px(points) / 36 - 1) > 0.5
    assert abs(robust_px(points) / 36 - 1) < 0.015


def test_masked_pixels_do_not_count() -> None:
    points = _plane(40, 24, 36.0)
    points[:8, :, :2] *= 6
    confidence = np.full((24, 40), 3.0, np.float32)
    confidence[:8] = 1
    assert robust_px(points, confidence) == pytest.approx(36, rel=1e-5)
    assert abs(weiszfeld_px(points) / 36 - 1) > 0.02


def test_a_pinhole_beside_the_middle_with_oblong_pixels() -> None:
    columns, rows = np.meshgrid((np.arange(40) - 17) / 36, (np.arange(24) - 14) / 18)
    depth = 4 + 0.05 * np.arange(24)[:, None] + 0 * columns
    points = np.stack([columns * depth, rows * depth, depth], axis=-1).astype(np.float32)
    assert robust_px(points, None, (17, 14), 2.0) == pytest.approx(36, rel=1e-5)
    assert abs(robust_px(points) / 36 - 1) > 0.05


def test_nothing_to_go_by_is_not_a_focal_length() -> None:
    assert np.isnan(robust_px(_plane(8, 6, 9.0), np.ones((6, 8))))


def test_votes_share_a_focal_length_and_tell_their_spread() -> None:
    truth = street(12, 64, 36)
    maps = pair_maps(truth, window(12), Noise(0, 1 / 8, 0, 0, 0))
    exact = focal_votes(maps, graph_of(maps))
    assert exact.shared_px == pytest.approx(truth.focal_px, rel=1e-5)
    assert exact.spread < 1e-5
    maps = pair_maps(truth, window(12), Noise(focal=0.05))
    noisy = focal_votes(maps, graph_of(maps))
    assert noisy.shared_px == pytest.approx(truth.focal_px, rel=0.03)
    assert 0.03 < noisy.spread < 0.08
    assert noisy.per_image_px(12).shape == (12,)
    assert np.abs(noisy.per_image_px(12) / truth.focal_px - 1).max() < 0.12


def test_weighted_median() -> None:
    assert weighted_median(np.array([3.0, 1.0, 2.0]), np.array([1.0, 1.0, 1.0])) == 2
    assert weighted_median(np.array([3.0, 1.0, np.nan]), np.array([5.0, 1.0, 9.0])) == 3
    assert np.isnan(weighted_median(np.array([1.0]), np.array([0.0])))


def _plane(width: int, height: int, focal: float) -> np.ndarray:
    columns, rows = np.meshgrid(
        (np.arange(width) - width / 2) / focal, (np.arange(height) - height / 2) / focal
    )
    depth = 4 + 0.05 * np.arange(height)[:, None] + 0 * columns
    return np.stack([columns * depth, rows * depth, depth], axis=-1).astype(np.float32)
