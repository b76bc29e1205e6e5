"""What stereo takes for standing, and the road does not carry, on a rendered street."""

import numpy as np
import pytest
from tests.geometry import toy

from dreamdrive.geometry.dense import densify
from dreamdrive.geometry.depth.view import View, make_view, single_threaded_opencv
from dreamdrive.geometry.moving.evidence import FLAGGED
from dreamdrive.geometry.moving.floating import floating
from dreamdrive.geometry.moving.flow import PairFlow, neighbour_flows

FRAME = 3
STEP_M = 0.8


def seen(street: toy.Toy) -> tuple[View, list[PairFlow]]:
    posed = street.posed
    view = make_view(street.clip, posed.cameras, posed.fixed_regions, posed.ground)
    with single_threaded_opencv():
        return view, neighbour_flows(view)[FRAME]


def stereo(street: toy.Toy, nearer: float) -> np.ndarray:
    """Inverse depth as stereo finds it, that of the boxes ``nearer`` times the true one."""
    depth = street.depth_m[FRAME]
    inverse = np.where(depth > 0, 1 / np.maximum(depth, 0.1), 0)
    return np.where(street.box[FRAME], nearer * inverse, inverse).astype(np.float32)


@pytest.fixture(scope="module")
def oncoming() -> toy.Toy:
    return toy.drive([toy.Box(15, -3.5, -STEP_M)], step_m=STEP_M)


def found(street: toy.Toy, nearer: float, confidence: float = 0.9) -> np.ndarray:
    view, flows = seen(street)
    trust = np.full(street.box[FRAME].shape, confidence, np.float32)
    sky = street.depth_m[FRAME] == 0
    return floating(view, FRAME, flows, stereo(street, nearer), trust, sky).likely


def test_what_is_nearer_than_the_road_it_stands_on_floats(oncoming):
    box = oncoming.box[FRAME]
    likely = found(oncoming, 2.0)
    assert likely[box].mean() > 0.9
    assert likely[~box].mean() < 0.01


@pytest.mark.parametrize("nearer", [0.9, 1.0, 1.15])
def test_what_stands_on_the_road_does_not(oncoming, nearer):
    assert not found(oncoming, nearer).any()


def test_nothing_is_said_without_trust_in_the_depth(oncoming):
    assert not found(oncoming, 2.0, confidence=0.3).any()


def test_an_oncoming_box_is_flagged_and_the_same_parked_is_not(oncoming):
    dense = densify(oncoming.clip, oncoming.posed)
    middle = slice(2, 5)
    flagged, box = dense.moving[middle] >= FLAGGED, oncoming.box[middle]
    assert flagged[box].mean() > 0.6
    assert flagged[~box].mean() < 0.01
    parked = toy.drive([toy.Box(15, -3.5, 0)], step_m=STEP_M)
    assert (densify(parked.clip, parked.posed).moving[parked.box] >= FLAGGED).mean() < 0.02
