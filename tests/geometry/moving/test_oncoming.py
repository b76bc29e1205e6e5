"""What drives towards the camera, by where it meets the road, on a rendered street."""

from dataclasses import replace

import numpy as np
import pytest

from dreamdrive.geometry import GeometryOptions, MovingOptions
from dreamdrive.geometry.dense import densify
from dreamdrive.geometry.depth.view import PosedFrames, make_view
from dreamdrive.geometry.moving.evidence import FLAGGED
from dreamdrive.geometry.moving.oncoming import oncoming
from tests.geometry import toy

STEP_M = 0.8
MIDDLE = slice(2, 5)


def seen(street: toy.Toy) -> PosedFrames:
    posed = street.posed
    return make_view(street.clip, posed.cameras, posed.fixed_regions, posed.ground)


def found(street: toy.Toy) -> np.ndarray:
    masks = oncoming(seen(street))
    return np.stack([masks[frame] for frame in sorted(masks)])


@pytest.mark.parametrize("speed", [0.6, 1.0, 1.4])
def test_a_box_that_comes_is_found_whole_and_nothing_else(speed: float) -> None:
    street = toy.drive([toy.Box(17, -3.5, -speed * STEP_M)], step_m=STEP_M)
    masks, box = found(street)[MIDDLE], street.box[MIDDLE]
    assert masks[box].mean() > 0.7
    assert masks[~box].mean() < 0.02


@pytest.mark.parametrize("speed", [0.0, 0.15, -0.5])
def test_what_stands_creeps_or_drives_ahead_is_not(speed: float) -> None:
    assert not found(toy.drive([toy.Box(15, -3.5, -speed * STEP_M)], step_m=STEP_M)).any()


def test_two_frames_have_to_agree() -> None:
    street = toy.drive([toy.Box(17, -3.5, -STEP_M)], step_m=STEP_M)
    view = seen(street)
    only = replace(view, used=np.arange(len(view.used)) < 1)
    assert not oncoming(only)[0].any()


def test_without_a_road_nothing_is_found() -> None:
    view = seen(toy.drive([toy.Box(17, -3.5, -STEP_M)], step_m=STEP_M))
    flat = replace(view, plane_inverse=np.zeros_like(view.plane_inverse))
    assert not any(mask.any() for mask in oncoming(flat).values())


def test_a_road_that_leaves_the_picture_is_no_trouble() -> None:
    view = seen(toy.drive([toy.Box(17, -3.5, -STEP_M)], step_m=STEP_M))
    plane = view.plane_inverse.copy()
    plane[:, :, :40] = 0
    assert oncoming(replace(view, plane_inverse=plane))[3].any()


def test_an_oncoming_box_is_flagged_and_the_same_parked_is_not() -> None:
    coming = toy.drive([toy.Box(15, -3.5, -STEP_M)], step_m=STEP_M)
    dense = densify(coming.clip, coming.posed)
    flagged, box = dense.moving[MIDDLE] >= FLAGGED, coming.box[MIDDLE]
    assert flagged[box].mean() > 0.6
    assert flagged[~box].mean() < 0.01
    unlooked = GeometryOptions(moving=MovingOptions(oncoming=False))
    assert (densify(coming.clip, coming.posed, unlooked).moving[coming.box] >= FLAGGED).mean() < 0.3
    parked = toy.drive([toy.Box(15, -3.5, 0)], step_m=STEP_M)
    assert (densify(parked.clip, parked.posed).moving[parked.box] >= FLAGGED).mean() < 0.02
