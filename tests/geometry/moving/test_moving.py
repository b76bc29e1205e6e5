"""Evidence of motion on rendered streets, and the shapes it is given."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra.numpy import arrays

from dreamdrive.geometry.dense import densify, upright_depth
from dreamdrive.geometry.moving.evidence import FLAGGED, decide, fill
from tests.geometry import toy


def flagged_shares(street: toy.Toy) -> tuple[float, float, float]:
    """Shares of box and of the rest that are flagged, and the median depth error on the box."""
    dense = densify(street.clip, street.posed)
    flagged, box = dense.moving >= FLAGGED, street.box
    error = np.abs(dense.depth_m[box] / street.depth_m[box] - 1)
    return float(flagged[box].mean()), float(flagged[~box].mean()), float(np.median(error))


def test_a_box_driving_ahead_is_flagged_and_stands_on_the_road():
    on, off, error = flagged_shares(toy.drive([toy.Box(9, -0.9, 0.8)]))
    assert on > 0.6
    assert off < 0.005
    assert error < 0.15


def test_the_same_box_parked_is_not_flagged():
    on, off, _ = flagged_shares(toy.drive([toy.Box(14, -0.9, 0)]))
    assert on < 0.02
    assert off < 0.005


def test_a_box_passing_a_standing_camera_is_flagged():
    on, off, _ = flagged_shares(toy.drive([toy.Box(7, -3, 2)], step_m=0))
    assert on > 0.6
    assert off < 0.01


def test_given_depth_shows_any_motion_relative_to_it():
    street = toy.drive([toy.Box(16, -3.5, -0.8)])
    known = street.clip.known
    clip = toy.replace(street.clip, known=toy.replace(known, depth_m=street.depth_m))
    dense = densify(clip, street.posed)
    middle = dense.moving[3] >= FLAGGED
    assert middle[street.box[3]].mean() > 0.5
    assert middle[~street.box[3]].mean() < 0.02
    np.testing.assert_allclose(dense.depth_m[street.box], street.depth_m[street.box], rtol=1e-5)


@settings(max_examples=50)
@given(arrays(bool, (12, 15)))
def test_filling_only_adds(region):
    filled = fill(region)
    assert filled[region].all()
    if not region.any():
        assert not filled.any()


def test_filling_closes_rings_and_notches_at_the_edge_of_the_image():
    ring = np.zeros((10, 10), bool)
    ring[2:8, 2:8] = True
    ring[4:6, 4:6] = False
    assert fill(ring)[4:6, 4:6].all()
    notch = np.zeros((10, 10), bool)
    notch[2:8, :4] = True
    notch[4:6, :2] = False
    assert fill(notch)[4:6, :2].all()


def test_specks_and_unsure_regions_stay_below_the_threshold():
    votes = np.zeros((90, 160), np.float32)
    votes[40:60, 40:80] = 0.8
    votes[10:12, 10:12] = 1
    sure = votes > 0.9
    usable = np.ones(votes.shape, bool)
    assert decide(votes, sure, usable).max() < FLAGGED
    sure[45:55, 50:60] = True
    evidence = decide(votes, sure, usable)
    assert evidence[50, 60] >= FLAGGED
    assert evidence[11, 11] < FLAGGED
    usable[50, 60] = False
    assert decide(votes, sure, usable)[50, 60] == 0


@pytest.mark.parametrize("bottom", [30, 39])
def test_upright_depth_is_that_of_the_contact_row(bottom):
    plane = np.maximum(np.arange(40) - 20, 0)[:, None] * np.full((1, 30), 0.01, np.float32)
    flagged = np.zeros((40, 30), bool)
    flagged[10 : bottom + 1, 5:15] = True
    inverse = upright_depth(flagged, plane.astype(np.float32))
    np.testing.assert_allclose(inverse[flagged], plane[bottom, 0], rtol=1e-6)
    assert (inverse[~flagged] == 0).all()
