"""Two images without optimisation."""

from pathlib import Path

import numpy as np
import pytest
from tests.geometry.backends.dust3r.align.goldens import scene
from tests.geometry.backends.dust3r.align.pairs import path_error, street

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.pairmaps import PairMaps
from dreamdrive.geometry.backends.dust3r.reference.clean import world_points
from dreamdrive.geometry.backends.dust3r.reference.pair_viewer import view_pair
from geometry.simulated_pairs import Noise, pair_maps


def test_it_is_golden(golden_dir: Path) -> None:
    maps, _, wanted = scene(golden_dir, "C")
    found = view_pair(maps)
    np.testing.assert_allclose(found.world_from_camera, wanted["poses"], atol=1e-6)
    np.testing.assert_allclose(found.focals_px, wanted["focals"], rtol=1e-6)
    for image, depth in enumerate(found.depth):
        np.testing.assert_allclose(depth, wanted[f"depth.{image}"], rtol=2e-6)
        points = world_points(depth, found.world_from_camera[image], float(found.focals_px[image]))
        np.testing.assert_allclose(points, wanted[f"pts3d.{image}"], atol=2e-6)


def test_the_mirrored_golden_pair_is_mirrored(golden_dir: Path) -> None:
    maps, _, _ = scene(golden_dir, "C")
    found, other = view_pair(maps), view_pair(PairMaps(1 - maps.edges, maps.points, maps.confidence))
    np.testing.assert_array_equal(found.world_from_camera[::-1], other.world_from_camera)
    np.testing.assert_array_equal(found.depth[0], other.depth[1])


def test_a_failure_on_a_golden_pair_is_told(golden_dir: Path) -> None:
    maps, _, _ = scene(golden_dir, "C")
    assert len(view_pair(maps, confident=1e9).unsure) == 1
    assert view_pair(maps).unsure == ()


def test_three_images_are_not_a_pair() -> None:
    truth = street(3, 32, 20)
    with pytest.raises(InputError, match=r"edges \(0, 1\) and \(1, 0\)"):
        view_pair(pair_maps(truth, np.array([(0, 1), (1, 2)]), Noise()))


def test_an_exact_pair_is_the_truth() -> None:
    truth = street(2, 48, 30)
    found = view_pair(pair_maps(truth, np.array([(1, 0), (0, 1)]), Noise(0, 1 / 8, 0, 0, 0)))
    np.testing.assert_allclose(found.focals_px, truth.focal_px, rtol=1e-2)
    assert path_error(found.world_from_camera, truth.world_from_camera) < 1e-6
