"""Two images without optimisation."""

import numpy as np
import pytest
from tests.geometry.backends.dust3r.align.pairs import path_error, street
from tests.geometry.backends.dust3r.align.scenes import PNP, check_poses, scene, scenes_with
from tests.golden.reading import close

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.pairmaps import PairMaps
from dreamdrive.geometry.backends.dust3r.reference.clean import world_points
from dreamdrive.geometry.backends.dust3r.reference.pair_viewer import view_pair
from geometry.simulated_pairs import Noise, pair_maps


@pytest.mark.parametrize("name", scenes_with("poses"))
def test_it_is_golden(name: str) -> None:
    """To what a pose from PnP may differ; the camera of the other image is the world."""
    given = scene(name)
    wanted, found = given.outputs, view_pair(given.maps)
    check_poses(found.world_from_camera, wanted["poses"], PNP)
    close(found.focals_px, wanted["focals"], 1e-5)
    for image, depth in enumerate(found.depth):
        close(depth, wanted[f"depth.{image}"], PNP)
        # Of their own depth and cameras: the rule alone.
        own = wanted[f"depth.{image}"], wanted["poses"][image], float(wanted["focals"][image])
        close(world_points(*own), wanted[f"pts3d.{image}"], 1e-5)


@pytest.fixture(scope="module")
def pair() -> PairMaps:
    return pair_maps(street(2, 48, 30), np.array([(0, 1), (1, 0)]), Noise())


def test_the_mirrored_pair_is_mirrored(pair: PairMaps) -> None:
    found, other = view_pair(pair), view_pair(PairMaps(1 - pair.edges, pair.points, pair.confidence))
    np.testing.assert_array_equal(found.world_from_camera[::-1], other.world_from_camera)
    np.testing.assert_array_equal(found.depth[0], other.depth[1])


def test_a_failure_is_told(pair: PairMaps) -> None:
    assert len(view_pair(pair, confident=1e9).unsure) == 1
    assert view_pair(pair).unsure == ()


def test_three_images_are_not_a_pair() -> None:
    truth = street(3, 32, 20)
    with pytest.raises(InputError, match=r"edges \(0, 1\) and \(1, 0\)"):
        view_pair(pair_maps(truth, np.array([(0, 1), (1, 2)]), Noise()))


def test_an_exact_pair_is_the_truth() -> None:
    truth = street(2, 48, 30)
    found = view_pair(pair_maps(truth, np.array([(1, 0), (0, 1)]), Noise(0, 1 / 8, 0, 0, 0)))
    np.testing.assert_allclose(found.focals_px, truth.focal_px, rtol=1e-2)
    assert path_error(found.world_from_camera, truth.world_from_camera) < 1e-6
