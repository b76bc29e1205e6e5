"""The height of the camera, by the sizes of what stands on the road."""

from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import UInt8

from dreamdrive.prior.photo.height import USUAL_M, height_of
from dreamdrive.prior.photo.lanes import lane_widths
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.street.look import CameraEstimate, Look, RoadUser
from dreamdrive.scene.street.street_class import StreetClass

CAMERA = Camera(400.0, 400.0, 240.0, 135.0, 480, 270)
SEEN = CameraEstimate(480, 270, 400.0, 0.0, 0.0, 1.0, 0.0, 0.01, 0.0)


def seen(
    height_m: float, *sizes: tuple[StreetClass, float, float], classes: UInt8[np.ndarray, "h w"] | None = None
) -> Look:
    """A look at users of some kinds, distances and heights by a level camera."""
    road_users: list[RoadUser] = []
    instances = np.zeros((1, 270, 480), np.uint16)
    for kind, distance_m, tall_m in sizes:
        below = 135 + 400 * height_m / distance_m
        too_tall = 1.05 if kind == StreetClass.VEHICLE else 1.0  # as the network sees vehicles
        top = below - 400 * too_tall * tall_m / distance_m
        road_users.append(RoadUser(kind, 0.9, (200, round(top), 260, round(below)), 900))
        instances[0, round(top) : round(below), 200:260] = len(road_users)
    blank = np.zeros((1, 270, 480))
    return Look(
        blank.astype(np.float32),
        blank.astype(np.float16),
        (blank if classes is None else classes[None]).astype(np.uint8),
        blank.astype(np.float16),
        instances,
        (tuple(road_users),),
        (SEEN,),
        SEEN,
    )


def test_without_road_users_it_is_the_usual_one() -> None:
    found = height_of(seen(1.5), CAMERA)
    assert found.metres == pytest.approx(USUAL_M, rel=0.01)
    assert found.road_users == 0
    assert 0.2 < found.spread < 0.3


@pytest.mark.parametrize("height_m", [1.2, 1.5, 2.2])
def test_cars_and_people_tell_it(height_m: float) -> None:
    car, person = (StreetClass.VEHICLE, 14.0, 1.48), (StreetClass.PERSON, 9.0, 1.7)
    found = height_of(seen(height_m, car, person, (StreetClass.VEHICLE, 20.0, 1.5)), CAMERA)
    assert found.metres == pytest.approx(height_m, rel=0.08)
    assert found.road_users == 3
    assert found.spread < 0.16


def test_a_lorry_among_cars_is_taken_for_one() -> None:
    car = (StreetClass.VEHICLE, 12.0, 1.48)
    found = height_of(seen(1.4, car, car, (StreetClass.VEHICLE, 18.0, 3.3)), CAMERA)
    assert found.metres == pytest.approx(1.4, rel=0.08)


def test_who_is_cut_off_tells_nothing() -> None:
    near = (StreetClass.VEHICLE, 3.0, 1.48)  # its foot is below the picture
    assert height_of(seen(1.5, near), CAMERA).road_users == 0


def test_a_single_row_that_sticks_out_of_a_car_is_not_its_top() -> None:
    look = seen(1.5, (StreetClass.VEHICLE, 12.0, 1.48))
    left, top, right, below = look.road_users[0][0].box_px
    taller = (RoadUser(StreetClass.VEHICLE, 0.9, (left, top - 20, right, below), 900),)
    look.instances[0, top - 20 : top, 220:224] = 1
    plain = height_of(seen(1.5, (StreetClass.VEHICLE, 12.0, 1.48)), CAMERA)
    assert height_of(replace(look, road_users=(taller,)), CAMERA).metres == pytest.approx(plain.metres)


@pytest.mark.parametrize("height_m", [1.2, 1.9])
def test_lanes_tell_it(height_m: float) -> None:
    found = height_of(seen(height_m, classes=lines(height_m, (-1.675, 1.675, 5.025))), CAMERA)
    assert (found.road_users, found.lanes) == (0, 2)
    assert found.metres == pytest.approx(height_m, rel=0.08)
    assert found.spread < 0.17


def test_one_line_is_no_lane() -> None:
    assert lane_widths(seen(1.5, classes=lines(1.5, (-1.7,))), CAMERA) == []
    assert lane_widths(seen(1.5), CAMERA) == []


def lines(height_m: float, at_m: tuple[float, ...]) -> UInt8[np.ndarray, "h w"]:
    """Classes of a road with lines at some places across."""
    down = np.arange(270)[:, None] + 0.5 - 135
    across_m = (np.arange(480)[None, :] + 0.5 - 240) * height_m / np.maximum(down, 0.1)
    line = np.any([np.abs(across_m - x) < 0.08 for x in at_m], axis=0) & (down > 0)
    return np.where(line, StreetClass.MARKING, StreetClass.ROAD).astype(np.uint8)
