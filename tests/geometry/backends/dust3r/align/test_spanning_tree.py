"""The start of an alignment: upstream's, number for number, and ours without its defects."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.geometry.backends.dust3r.align.spanning_tree import AlignmentStart, spanning_tree
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps
from dreamdrive_bench.geometry.simulated_pairs import Noise, pair_maps
from tests.geometry.backends.dust3r.align.pairs import path_error, street, window
from tests.geometry.backends.dust3r.align.scenes import PNP, extent, runs_with, scene
from tests.golden.reading import close

EXACT = Noise(0, 1 / 8, 0, 0, 0)


@pytest.mark.parametrize(("name", "run"), runs_with("init.focals"))
def test_the_switch_gives_the_golden_start(name: str, run: str) -> None:
    """To the rounding of the authors' float32, and of OpenCV where it posed an image."""
    given = scene(name)
    wanted = given.outputs.under(f"{run}.init.")
    start = spanning_tree(given.maps, upstream=True, stale_focals=run != "fixed")
    close(start.focals_px, wanted["focals"], 1e-5)
    close(_matrices(start), wanted["pw_poses"], 1e-5)
    loose = given.posed_by_pnp(run)
    for image, depth in enumerate(start.depth):
        limit = PNP if image in loose else 1e-5
        difference = start.world_from_camera[image] - wanted["poses"][image]
        assert np.abs(difference[:3, :3]).max() < limit
        assert np.abs(difference[:3, 3]).max() < limit * extent(wanted["poses"])
        apart = np.abs(depth - wanted[f"depth.{image}"]) / np.abs(wanted[f"depth.{image}"]).max()
        # A point in the plane of the camera may fall on either side of it.
        assert np.quantile(apart, 0.998) < limit


@pytest.fixture(scope="module")
def two_lenses() -> tuple[PairMaps, np.ndarray, np.ndarray]:
    """A drive whose every third image has a focal length 1.5 times as long, poses and focal lengths."""
    drives = [street(6, 48, 30), street(6, 48, 30, focal=1.35)]
    images = [drives[1] if image % 3 == 2 else drives[0] for image in range(6)]
    focals = np.array([truth.focal_px for truth in images])
    maps = [pair_maps(truth, window(6), Noise(outliers=0, focal=0)) for truth in drives]
    points, confidence = (
        tuple(
            tuple(parts[image % 3 == 2][edge][side] for side, image in enumerate(pair))
            for edge, pair in enumerate(window(6).tolist())
        )
        for parts in ([each.points for each in maps], [each.confidence for each in maps])
    )
    return PairMaps(window(6), points, confidence), drives[0].world_from_camera, focals


def test_an_image_has_its_own_focal_length(two_lenses) -> None:
    maps, _, focals = two_lenses
    ours, theirs = spanning_tree(maps), spanning_tree(maps, upstream=True)
    assert np.abs(theirs.focals_px / focals - 1).max() > 0.2
    assert np.abs(ours.focals_px / focals - 1).max() < 0.02


def test_ours_starts_nearer_to_the_truth() -> None:
    truth = street(6, 48, 30)
    errors = [
        [
            path_error(spanning_tree(maps, upstream=upstream).world_from_camera, truth.world_from_camera)
            for upstream in (False, True)
        ]
        for maps in (pair_maps(truth, window(6), Noise(), seed=seed) for seed in range(4))
    ]
    ours, theirs = np.mean(errors, axis=0)
    assert ours < 0.5 * theirs


def test_exact_pairs_give_the_truth_even_where_no_edge_starts() -> None:
    truth = street(5, 48, 30)
    one_way = pair_maps(truth, np.array([(0, 1), (0, 2), (1, 3), (2, 3), (2, 4)]), EXACT)
    for edges in (window(5), one_way.edges):
        start = spanning_tree(pair_maps(truth, edges, EXACT))
        assert path_error(start.world_from_camera, truth.world_from_camera) < 1e-3


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


def _matrices(start: AlignmentStart) -> np.ndarray:
    matrices = np.tile(np.eye(4), (len(start.pairs), 1, 1))
    for matrix, pair in zip(matrices, start.pairs, strict=True):
        matrix[:3, :3], matrix[:3, 3] = pair.scale * pair.rotation, pair.translation
    return matrices
