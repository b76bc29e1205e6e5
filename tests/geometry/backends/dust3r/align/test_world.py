"""Noisy pairs of a drawn street with moving cars."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.geometry.backends.dust3r.align.alignment import AlignOptions, align
from dreamdrive_bench.geometry.simulated_pairs import Noise, pair_maps, truth_of
from streetworld import make_street
from tests.geometry.backends.dust3r.align.pairs import path_error, window


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["distance", "robust"])
def test_path_and_focal_length_of_a_street(objective: str) -> None:
    truth = truth_of(make_street(1, 12, 5.0, (160, 96)))
    assert truth.instance is not None
    assert truth.instance.any()
    maps = pair_maps(truth, window(12), Noise(), seed=1)
    found = align(maps, AlignOptions(objective=objective, samples_per_image=1000))
    assert path_error(found.world_from_camera, truth.world_from_camera) < 0.01
    assert abs(found.focals_px[0] / truth.focal_px - 1) < 0.03
    assert found.path_observed
    assert found.focal_agreed
    seen = (truth.depth > 0) & (truth.instance == 0)
    ratio = np.stack(found.depth)[seen] / truth.depth[seen]
    assert np.median(np.abs(ratio / np.median(ratio) - 1)) < 0.06


@pytest.mark.slow
def test_masking_what_moves_does_no_harm() -> None:
    truth = truth_of(make_street(2, 10, 5.0, (160, 96)))
    assert truth.instance is not None
    maps = pair_maps(truth, window(10), Noise(), seed=2)
    masked = tuple(
        tuple(
            np.where(truth.instance[image] > 0, np.float32(1), side)
            for image, side in zip(edge, pair, strict=True)
        )
        for edge, pair in zip(maps.edges, maps.confidence, strict=True)
    )
    errors = [
        path_error(
            align(each, AlignOptions(samples_per_image=1000)).world_from_camera, truth.world_from_camera
        )
        for each in (maps, replace(maps, confidence=masked))
    ]
    assert max(errors) < 0.01
