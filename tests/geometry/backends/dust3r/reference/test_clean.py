"""Points that contradict other images lose their confidence."""

import numpy as np
import pytest
from tests.geometry.backends.dust3r.align.scenes import scenes_with
from tests.golden.reading import arrays

from dreamdrive.geometry.backends.dust3r.reference.clean import clean, world_points


@pytest.mark.parametrize("name", scenes_with("clean_conf.0"))
def test_it_is_golden(name: str) -> None:
    """But for points that rounding brings over an edge: of a pixel, or of being a thousandth nearer."""
    wanted = arrays(f"dust3r/align_{name}_outputs.safetensors")
    final, images = wanted.under("cosine.final."), wanted.numbers("im_conf.")
    found = clean(
        [wanted[f"im_conf.{i}"] for i in images],
        [final[f"depth.{i}"] for i in images],
        [final[f"pts3d.{i}"] for i in images],
        final["poses"],
        final["focals"],
    )
    for image in images:
        assert (found[image] != wanted[f"clean_conf.{image}"]).mean() <= 0.002


def test_a_floater_goes_and_what_it_hid_stays() -> None:
    depth = [np.full((10, 12), 4.0), np.full((10, 12), 4.0)]
    depth[0][4:6, 5:7] = 1.0
    trust = [np.full((10, 12), 2.0), np.full((10, 12), 5.0)]
    poses = np.stack([np.eye(4), np.eye(4)])
    points = [world_points(each, np.eye(4), 10.0) for each in depth]
    found = clean(trust, depth, points, poses, np.array([10.0, 10.0]))
    assert (found[0][4:6, 5:7] == 0).all()
    assert (found[0] == 0).sum() == 4
    np.testing.assert_array_equal(found[1], trust[1])
    trusted = clean([trust[1], trust[0]], depth, points, poses, np.array([10.0, 10.0]))
    assert (trusted[0] > 0).all()
