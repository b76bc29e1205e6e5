"""What is completed on upright things: smooth flanks down to the road, roofs by their colour."""

import numpy as np

from dreamdrive.geometry.classical.depth import Swept
from dreamdrive.geometry.classical.flanks import fill_flanks
from dreamdrive.geometry.classical.roof import grow_upwards

SHAPE = (60, 80)
UNKNOWN = np.zeros(SHAPE, np.float32)
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


def test_a_roof_of_the_same_colour_is_added_and_the_background_is_not():
    rng = np.random.default_rng(0)
    rgb = rng.normal((60, 120, 60), 8, (*SHAPE, 3))
    rgb[20:50, 30:50] = rng.normal((200, 30, 30), 8, (30, 20, 3))
    frame = np.clip(rgb, 0, 255).astype(np.uint8)
    flagged = np.zeros(SHAPE, bool)
    flagged[32:50, 30:50] = True
    grown = grow_upwards(frame, flagged, np.zeros(SHAPE, bool), UNKNOWN)
    assert grown[flagged].all()
    assert grown[22:32, 31:49].mean() > 0.9
    assert grown[:18].mean() < 0.02
    np.testing.assert_array_equal(grown, grow_upwards(frame, flagged, np.zeros(SHAPE, bool), UNKNOWN))
    sky = np.zeros(SHAPE, bool)
    sky[:26] = True
    assert not grow_upwards(frame, flagged, sky, UNKNOWN)[:26].any()


def test_nothing_flagged_stays_nothing():
    frame = np.zeros((*SHAPE, 3), np.uint8)
    assert not grow_upwards(frame, np.zeros(SHAPE, bool), np.zeros(SHAPE, bool), UNKNOWN).any()
