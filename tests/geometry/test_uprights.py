"""What is completed on upright things: smooth flanks down to the road."""

import numpy as np

from dreamdrive.geometry.depth.confidence import fill_flanks
from dreamdrive.geometry.depth.one_frame import Swept

SHAPE = (60, 80)
PLANE = (np.maximum(np.arange(60) - 20, 0)[:, None] * np.full((1, 80), 0.005)).astype(np.float32)
CONTACT = 50
STREET = np.ones(SHAPE, bool)


def scene(lowest: int) -> tuple[Swept, np.ndarray]:
    """A thing at the depth of row 50, confirmed from row 25 to ``lowest``; the sweep says road below that."""
    inverse, confidence = PLANE.copy(), np.zeros(SHAPE, np.float32)
    inverse[25:lowest, 30:50] = PLANE[CONTACT, 0]
    confidence[25:lowest, 30:50] = 0.9
    on_plane = inverse == PLANE
    return Swept(inverse, np.full(SHAPE, 0.3, np.float32), on_plane), confidence


def test_a_flank_is_filled_to_its_contact_with_the_road():
    swept, confidence = scene(CONTACT - 3)
    confidence[32:44, 30:50] = 0
    swept.inverse_depth[32:44, 30:50] = PLANE[32:44, 30:50]
    swept.on_plane[32:44, 30:50] = True
    inverse, trust = fill_flanks(swept, confidence, PLANE, STREET)
    np.testing.assert_allclose(inverse[25 : CONTACT - 5, 30:50], PLANE[CONTACT, 0])
    assert (trust[32:44, 30:50] > 0).all()
    np.testing.assert_array_equal(inverse[:, :30], PLANE[:, :30])
    np.testing.assert_array_equal(inverse[CONTACT + 1 :], PLANE[CONTACT + 1 :])


def test_what_hangs_and_what_the_road_contradicts_is_left_alone():
    hanging, confidence = scene(32)
    inverse, _ = fill_flanks(hanging, confidence, PLANE, STREET)
    np.testing.assert_array_equal(inverse, hanging.inverse_depth)
    swept, confidence = scene(32)
    swept.correlation[32:] = 0.9
    inverse, _ = fill_flanks(swept, confidence, PLANE, STREET)
    np.testing.assert_array_equal(inverse, swept.inverse_depth)
