"""The height of the camera, by the sizes of what stands on the road."""

import numpy as np
import pytest

from dreamdrive.prior.photo.height import USUAL_M, height_of
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.look import CameraEstimate, Look, RoadUser
from dreamdrive.scene.street_class import StreetClass

CAMERA = Camera(400.0, 400.0, 240.0, 135.0, 480, 270)
SEEN = CameraEstimate(480, 270, 400.0, 0.0, 0.0, 1.0, 0.0, 0.01, 0.0)


def seen(height_m: float, *sizes: tuple[StreetClass, float, float]) -> Look:
    """A look at users of some kinds, distances and heights by a level camera."""
    users: list[RoadUser] = []
    for kind, distance_m, tall_m in sizes:
        below = 135 + 400 * height_m / distance_m
        top = below - 400 * tall_m / distance_m
        users.append(RoadUser(kind, 0.9, (200, round(top), 260, round(below)), 900))
    blank = np.zeros((1, 270, 480))
    return Look(
        blank.astype(np.float32),
        blank.astype(np.float16),
        blank.astype(np.uint8),
        blank.astype(np.float16),
        blank.astype(np.uint16),
        (tuple(users),),
        (SEEN,),
        SEEN,
    )


def test_without_road_users_it_is_the_usual_one() -> None:
    found = height_of(seen(1.5), CAMERA)
    assert found.metres == pytest.approx(USUAL_M, rel=0.01)
    assert found.users == 0
    assert 0.2 < found.spread < 0.3


@pytest.mark.parametrize("height_m", [1.2, 1.5, 2.2])
def test_cars_and_people_tell_it(height_m: float) -> None:
    car, person = (StreetClass.VEHICLE, 14.0, 1.48), (StreetClass.PERSON, 9.0, 1.7)
    found = height_of(seen(height_m, car, person, (StreetClass.VEHICLE, 20.0, 1.5)), CAMERA)
    assert found.metres == pytest.approx(height_m, rel=0.08)
    assert found.users == 3
    assert found.spread < 0.16


def test_a_lorry_among_cars_is_taken_for_one() -> None:
    car = (StreetClass.VEHICLE, 12.0, 1.48)
    found = height_of(seen(1.4, car, car, (StreetClass.VEHICLE, 18.0, 3.3)), CAMERA)
    assert found.metres == pytest.approx(1.4, rel=0.08)


def test_who_is_cut_off_tells_nothing() -> None:
    near = (StreetClass.VEHICLE, 3.0, 1.48)  # its foot is below the picture
    assert height_of(seen(1.5, near), CAMERA).users == 0
