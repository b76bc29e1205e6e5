"""Whole moving things from their textured parts, on a rendered street."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.geometry.depth.view import PosedFrames, make_view
from dreamdrive.geometry.moving.flow import PairFlow, neighbour_flows
from dreamdrive.geometry.moving.outline import outline
from dreamdrive.vision.flow import single_threaded_opencv
from tests.geometry import toy

FRAME = 3
HORIZON = toy.HEIGHT // 2
NO_SKY = np.zeros((toy.HEIGHT, toy.WIDTH), bool)


@pytest.fixture(scope="module")
def street() -> toy.Toy:
    """A van ahead that keeps its distance, plain and dark above a band of texture."""
    made = toy.drive([toy.Box(9, -3.5, 0.8, tall_m=2.3)])
    frames = made.clip.frames.copy()
    plain = made.box & (np.arange(toy.HEIGHT)[:, None] < HORIZON + 10)
    frames[plain] = (20, 22, 25)
    return replace(made, clip=replace(made.clip, frames=frames))


@pytest.fixture(scope="module")
def seen(street: toy.Toy) -> tuple[PosedFrames, list[PairFlow]]:
    posed = street.posed
    view = make_view(street.clip, posed.cameras, posed.fixed_regions, posed.ground)
    with single_threaded_opencv():
        return view, neighbour_flows(view)[FRAME]


def static_inverse(view: PosedFrames) -> np.ndarray:
    """Of the street without the van."""
    depth = toy.render(view.cameras[FRAME], [], FRAME)[1]
    return np.where(depth > 0, 1 / np.maximum(depth, 0.1), 0).astype(np.float32)


def test_the_plain_upper_part_is_found_with_the_textured_lower_one(street, seen):
    view, flows = seen
    box = street.box[FRAME]
    rows = np.arange(toy.HEIGHT)[:, None]
    found = outline(view, FRAME, flows, static_inverse(view), box & (rows > HORIZON + 12), NO_SKY)
    assert found[box].mean() > 0.9
    assert found[~box].mean() < 0.005
    assert found[box & (rows < HORIZON)].mean() > 0.7


def test_road_that_was_taken_for_the_thing_is_given_back(street, seen):
    view, flows = seen
    box = street.box[FRAME]
    rows, columns = np.nonzero(box)
    flagged = box.copy()
    flagged[HORIZON + 12 : rows.max(), columns.max() : columns.max() + 8] = True
    found = outline(view, FRAME, flows, static_inverse(view), flagged, NO_SKY)
    assert found[flagged & ~box].mean() < 0.2


def test_nothing_is_found_in_the_sky_or_from_nothing(street, seen):
    view, flows = seen
    box = street.box[FRAME]
    sky = np.zeros_like(box)
    sky[:HORIZON] = True
    assert not outline(view, FRAME, flows, static_inverse(view), box & ~sky, sky)[sky].any()
    assert not outline(view, FRAME, flows, static_inverse(view), np.zeros_like(box), NO_SKY).any()


def test_a_region_whose_motion_is_unknown_stays_as_it_is(street, seen):
    view, flows = seen
    nowhere = [replace(flow, trusted=np.zeros_like(flow.trusted)) for flow in flows]
    box = street.box[FRAME]
    np.testing.assert_array_equal(outline(view, FRAME, nowhere, static_inverse(view), box, NO_SKY), box)
