"""The start of an alignment: upstream's, number for number, and ours without its defects."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.geometry.backends.dust3r.align.goldens import scene
from tests.geometry.backends.dust3r.align.pairs import path_error, street, window

from dreamdrive.geometry.backends.dust3r.align.spanning_tree import Start, spanning_tree
from dreamdrive.geometry.backends.dust3r.pairmaps import PairMaps
from geometry.simulated_pairs import Noise, pair_maps

EXACT = Noise(0, 1 / 8, 0, 0, 0)


@pytest.mark.parametrize(("name", "run"), [("A", "cosine"), ("B", "cosine"), ("B", "fixed")])
def test_the_switch_gives_the_golden_start(golden_dir: Path, name: str, run: str) -> None:
    maps, _, wanted = scene(golden_dir, name)
    start = spanning_tree(maps, upstream=True, stale_focals=run != "fixed")
    np.testing.assert_allclose(start.focals_px, wanted[f"{run}.init.focals"], rtol=1e-5)
    np.testing.assert_allclose(start.world_from_camera, wanted[f"{run}.init.poses"], atol=1e-5)
    np.testing.assert_allclose(_matrices(start), wanted[f"{run}.init.pw_poses"], atol=1e-5)
    for image, depth in enumerate(start.depth):
        np.testing.assert_allclose(depth, wanted[f"{run}.init.depth.{image}"], rtol=1e-5)


def test_an_image_of_a_golden_scene_has_its_own_focal_length(golden_dir: Path) -> None:
    maps, inputs, _ = scene(golden_dir, "B")
    ours, theirs = spanning_tree(maps), spanning_tree(maps, upstream=True)
    assert np.abs(theirs.focals_px / inputs["gt.focals"] - 1).max() > 0.4
    assert np.abs(ours.focals_px / inputs["gt.focals"] - 1).max() < 0.02


def test_ours_starts_nearer_to_the_golden_truth(golden_dir: Path) -> None:
    maps, inputs, _ = scene(golden_dir, "A")
    errors = [
        path_error(spanning_tree(maps, upstream=upstream).world_from_camera, inputs["gt.cam2world"])
        for upstream in (False, True)
    ]
    assert errors[0] < 0.5 * errors[1]


def test_exact_pairs_give_the_truth_even_where_no_edge_starts() -> None:
    truth = street(5, 48, 30)
    one_way = pair_maps(truth, np.array([(0, 1), (0, 2), (1, 3), (2, 3), (2, 4)]), EXACT)
    for edges in (window(5), one_way.edges):
        start = spanning_tree(pair_maps(truth, edges, EXACT))
        assert path_error(start.world_from_camera, truth.world_from_camera) < 1e-3
        assert start.unsure == ()


def test_points_behind_a_camera_get_a_small_depth() -> None:
    truth = street(3, 48, 30)
    maps = pair_maps(truth, window(3), EXACT)
    points = [tuple(side.copy() for side in pair) for pair in maps.points]
    for pair in points:
        pair[0][20:22, 5:9, 2] *= -1
        pair[1][20:22, 5:9, 2] *= -1
    start = spanning_tree(PairMaps(maps.edges, tuple(points), maps.confidence))
    for depth in start.depth:
        assert (depth > 0).all()
        assert depth[20:22, 5:9].max() <= np.quantile(depth, 0.05)


def test_what_is_masked_does_not_matter() -> None:
    truth = street(4, 48, 30)
    maps = pair_maps(truth, window(4), Noise(outliers=0))
    garbage = tuple(
        tuple(
            np.where(trust[..., None] > 1, xyz, np.float32(np.nan)) for xyz, trust in zip(p, c, strict=True)
        )
        for p, c in zip(maps.points, maps.confidence, strict=True)
    )
    clean, dirty = spanning_tree(maps), spanning_tree(replace(maps, points=garbage))
    np.testing.assert_array_equal(clean.world_from_camera, dirty.world_from_camera)
    np.testing.assert_array_equal(clean.focals_px, dirty.focals_px)


def _matrices(start: Start) -> np.ndarray:
    matrices = np.tile(np.eye(4), (len(start.pairs), 1, 1))
    for matrix, pair in zip(matrices, start.pairs, strict=True):
        matrix[:3, :3], matrix[:3, 3] = pair.scale * pair.rotation, pair.translation
    return matrices
